"""Where model and measurement disagree, and which effect is missing.

Data flows up through the rooms: data (what was measured), replay (windows simulated), fit (linear
algebra and the nonlinear fit), explain (gap, candidates, search), next_experiment. Above them
result.py says what comes out, decide.py makes it, and diagnose.py is the door.
"""
