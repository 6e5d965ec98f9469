"""Measurements beside computed results: universal files, receptances on those of a result, and modes fitted to them."""
