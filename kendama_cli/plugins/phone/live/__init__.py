"""Phones that join 'kendama play': their sensors carry the cup while they are swung."""
