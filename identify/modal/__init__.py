"""Experimental modal analysis: poles, shapes and their quality from measured FRFs; MAC and its family;
pairing of modal tables.
"""
