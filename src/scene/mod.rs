//! Scenes: one TOML file that says what is simulated.

/// What is wrong with a scene and where.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct SceneError {
    message: String,
}
