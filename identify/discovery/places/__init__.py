"""Where something is missing, without a guess of what it is: at each place one unknown per line for all
postures.
"""
