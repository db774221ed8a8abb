"""Simulators that people have, as files: MuJoCo models and functional mock-up units, under the catalogue's
effects, and the corrected simulator handed back."""
