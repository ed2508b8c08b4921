//! curvature-feedback
