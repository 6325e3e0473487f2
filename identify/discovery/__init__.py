"""The loop that finds where model and measurement disagree, names the missing effect, adds it and shows the
gap shrink.

`loop` reads top down; `localise` says where, `candidates` what could be missing, `trial` refits one of them,
`evidence` chooses.
"""
