"""KUKA RSI."""
