"""Effects: named physical contributions to the model, one small file per kind; the registry of them is in
`base`.
"""
