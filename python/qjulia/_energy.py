"""The energy that a fit makes small."""
