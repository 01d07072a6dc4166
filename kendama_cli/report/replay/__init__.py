"""The replay of a run in space: what the stages' logs give, and the page's part that shows it."""
