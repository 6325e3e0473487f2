"""What is never quite as told, and what a model becomes where it is otherwise."""
