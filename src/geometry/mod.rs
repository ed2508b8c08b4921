//! Normals, areas, angles and curvature vectors of the current shape, with their derivatives.
