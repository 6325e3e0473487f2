"""Mistakes of the set-up: units, signs, order, frames and bodies other than stated, as discrete hypotheses.

A hypothesis is a change of the study itself (`edits`), so that what is scored is what a fit of the corrected
study would see.  `kinds` has one small file per family and `registry` the list of them; `score` fits a
variant quickly, `search` compares and combines them, `decide` says what is named, `check` and `fit` are what
the commands call, `apply` writes the corrected study.
"""
