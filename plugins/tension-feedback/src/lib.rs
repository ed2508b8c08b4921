//! Model II: tension keeps a contractile motor bound, which shortens the sheet.
//!
//! ```text
//! ∂m/∂t = k_on (1 - m) - k_off e^{-a σ⁺} m        σ⁺ = max(σ, 0)
//! l̄     = Φ(m) l⁰                                 Φ  = 1 - α m
//! ```
//!
//! m is the bound fraction of the motor, 0 to 1; σ the tension, force/length, positive where the
//! sheet is stretched (which of its readings, the scene says); a in length/force; k_on and k_off
//! in 1/time (k_off is the reference's k̃_off, unbinding without tension). Without tension
//! m → k_on/(k_on + k_off) at the rate k_on + k_off.
//!
//! Reference: A. Zakharov and K. Dasbiswas, Modeling mechanochemical pattern formation in elastic
//! sheets of biological matter, 2021. Its exp(-a σ Θ(σ)) is written here with σ⁺.

mod law;

rumple_plugin_sdk::export_plugin!(law::TensionFeedback);
