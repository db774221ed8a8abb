"""What a fitted hypothesis leaves: residual diagnostics and score tests by block."""
