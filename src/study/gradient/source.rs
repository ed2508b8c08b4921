//! A scene that is read again and again, each time with other overrides.

use std::path::PathBuf;

use crate::run::Result;
use crate::scene::Scene;

/// Where a scene is read from.
#[derive(Debug, Clone)]
pub enum SceneSource {
    /// This file.
    File(PathBuf),
    /// This text.
    Text {
        /// TOML.
        text: String,
        /// Stands for its file in messages.
        name: String,
    },
}

impl SceneSource {
    /// The scene after the overrides `set` and `over`; errors call `option` what `over` of a file comes from.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn scene(&self, set: &[String], over: &[String], option: &'static str) -> Result<Scene> {
        Ok(match self {
            Self::File(path) => Scene::varied(path, set, over, option)?,
            Self::Text { text, name } => Scene::parse(text, name, &[set, over].concat())?,
        })
    }

    /// What every override sets: paths of keys with list elements by their numbers.
    ///
    /// # Errors
    /// As for [`Scene::overridden_keys`].
    pub fn overridden_keys(
        &self,
        set: &[String],
        over: &[String],
        option: &'static str,
    ) -> Result<Vec<String>> {
        Ok(match self {
            Self::File(path) => Scene::overridden_keys(path, set, over, option)?,
            Self::Text { text, name } => {
                Scene::overridden_keys_in(text, name, &[set, over].concat())?
            }
        })
    }
}
