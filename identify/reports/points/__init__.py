"""The page on which nodes are put on the surfaces of a robot."""
