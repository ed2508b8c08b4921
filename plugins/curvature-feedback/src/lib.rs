//! Model I: upward curvature makes a morphogen that expands the sheet.
//!
//! ```text
//! ∂c/∂t = w H⁺/(1 + H⁺/H_s) - β c        H⁺ = max(H, 0)      (+ D Δc, by the engine)
//! l̄     = Φ(c) l⁰                        Φ  = Λ⁰/Λ(c)
//! Λ(c)  = (Λ_max e^{b c*} + Λ_min e^{b c})/(e^{b c*} + e^{b c})
//!       = Λ_min + (Λ_max - Λ_min)/(1 + e^{b (c - c*)})
//! ```
//!
//! c is the morphogen, in units of its own (so `c`, `c*` and `b` carry no unit); H the mean
//! curvature, 1/length, positive at the top of a bump towards the normal; l⁰ and l̄ the rest and
//! optimal length of a bond. The steady maximum is c = w H_s/β. With Λ⁰ = Λ_max (the default) the
//! sheet at c = 0 is strained by (1 - Λ_min/Λ_max) e^{-b c*}; Λ⁰ = Λ(0) makes it exactly free of
//! stress.
//!
//! Reference: A. Zakharov and K. Dasbiswas, Modeling mechanochemical pattern formation in elastic
//! sheets of biological matter, 2021. The saturation is printed there as w H Θ(H)/(1 + H/H_s); the
//! form with H⁺ is the same but has no 0·∞ at H = -H_s.

mod law;

rumple_plugin_sdk::export_plugin!(law::CurvatureFeedback);
