"""The static stage: where in the whole map was this scan taken?"""
