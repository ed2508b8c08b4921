//! The state: positions and species, and the layout of their unknowns.
