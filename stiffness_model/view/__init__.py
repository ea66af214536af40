"""The drive drawn: to scale, with its contact forces as arrows, turning, and its profile for the workshop."""
