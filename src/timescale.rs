//! Timescale policies: which of the two time derivatives is kept.

/// The policy of a scene that names none.
pub const DEFAULT_POLICY: &str = "quasi-static";

/// A timescale policy as a scene names it.
#[typetag::serde(tag = "kind")]
pub trait PolicySpec: std::fmt::Debug + Send + Sync {
    /// What the policy is called in results.
    fn name(&self) -> String;
}
