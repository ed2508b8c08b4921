//! The effects a scene can list: each file holds one, from its equation to its derivatives.
