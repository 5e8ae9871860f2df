//! A curve → the parameters of a scattering model, and what the curve cannot tell apart.
