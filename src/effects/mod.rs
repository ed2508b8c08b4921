//! The effects a scene can list: each file holds one, from its equation to its derivatives.

/// An effect as a scene lists it: its kind and parameters, not yet bound to a sheet.
#[typetag::serde(tag = "kind")]
pub trait EffectSpec: std::fmt::Debug + Send + Sync {
    /// What the effect is called in results.
    fn name(&self) -> String;
}
