"""Named physical effects, one a file, each with its parameters and what it changes in a chair.

In: nothing. Out, of each file: `EFFECT`, a record of mjchair.effects.effect with the parameters
(unit, typical size, bounds), the signature, the source, and the edit of an MjSpec.
"""
