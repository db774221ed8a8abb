"""What a controller designer takes away from a posterior: margins, closed loops, uncertainty sets, export."""
