"""Choice of the next try: the part that is yours."""


def propose(rng, remembered, settings):
    """Return the swing (amplitude as a fraction from -1 to 1, frequency [rad/s]) that the next rollout explores.

    ``rng`` is the generator to draw from, ``remembered`` the best swings so far, best first, as (reward, swing) with
    a reward of 100 for a catch, up to 50 for a ball that was let go and came down beside the cup, and -5 where it was
    never let go. ``settings.frequency_rad_s`` is the band to begin in.
    """
    raise NotImplementedError("write propose() in my-learner/my_learner/search.py")
