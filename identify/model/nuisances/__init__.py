"""What is never quite as stated, and what a model becomes where it is otherwise."""
