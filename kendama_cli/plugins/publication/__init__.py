"""Runs as figures and tables for papers, and as videos."""
