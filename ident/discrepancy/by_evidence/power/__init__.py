"""How small an effect would still be named, from the motion and the noise alone."""
