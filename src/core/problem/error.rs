//! Errors of a problem, with the part of it that they are about.

use std::fmt;

/// Part of a [`Problem`](super::Problem) that an error is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProblemPart {
    /// The sheet.
    Sheet,
    /// That it moves in its plane only.
    Planar,
    /// The material.
    Material,
    /// The law.
    Law,
    /// All effects together.
    Effects,
    /// One effect, from 0, and the key of its settings.
    Effect(usize, String),
    /// The integrator.
    Integrator,
    /// The drag.
    Drag,
    /// The equilibrium method.
    Equilibrium,
}

impl fmt::Display for ProblemPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sheet => f.write_str("sheet"),
            Self::Planar => f.write_str("planar"),
            Self::Material => f.write_str("material"),
            Self::Law => f.write_str("law"),
            Self::Effects => f.write_str("effects"),
            Self::Effect(number, key) => write!(f, "effect[{number}].{key}"),
            Self::Integrator => f.write_str("integrator"),
            Self::Drag => f.write_str("drag"),
            Self::Equilibrium => f.write_str("equilibrium"),
        }
    }
}

/// Validation error of a [`Problem`](super::Problem).
#[derive(Debug, Clone, thiserror::Error)]
#[error("{part}: {message}{}", help.as_ref().map(|help| format!(" ({help})")).unwrap_or_default())]
pub struct ProblemError {
    /// What is wrong.
    pub part: ProblemPart,
    /// In what way.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl ProblemError {
    /// The error of a part.
    pub fn new(part: ProblemPart, message: impl Into<String>, help: Option<&str>) -> Self {
        Self { part, message: message.into(), help: help.map(str::to_owned) }
    }
}
