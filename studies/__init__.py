"""Studies behind the documentation: each takes minutes to hours, goes on where it was, and leaves a table."""
