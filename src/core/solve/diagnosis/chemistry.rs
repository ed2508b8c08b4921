//! Why a chemistry came to no end.

use std::sync::Arc;

use super::{Diagnosis, Reason};
use crate::model::{Model, State};
use crate::num::Short;
use crate::solve::{Result, Workspace};

/// Change of a species by which its growth is judged, relative to its size.
const PROBE_CHANGE: f64 = 1e-4;
/// A species blows up that is so many times its typical magnitude, and would be infinite within this share of
/// the time until now.
const BLOW_UP_RATIO: f64 = 100.0;
const BLOW_UP_TIME_SHARE: f64 = 1e-2;
/// One that would be infinite within this share of the time blows up whatever its size: `exp(c)` does so at c = 30.
const AT_ONCE: f64 = 1e-9;

/// A species that grows ever faster at `state`, so that it would be infinite in no time:
///
/// ```text
/// T = 1 / (R'/R - R/c),   R = dc/dt,   R' its derivative along the way        c/((p-1) R) for R = k cᵖ
/// ```
///
/// # Errors
/// If the model has no value there.
pub fn runaway(workspace: &mut Workspace, state: &State) -> Result<Option<Diagnosis>> {
    let model = Arc::clone(&workspace.model);
    let Some(chemistry) = model.chemistry() else { return Ok(None) };
    let rates = workspace.at(state).rates()?.to_vec();
    let species = &chemistry.descriptor().species;
    let largest = |s: usize| {
        let each =
            rates[s].iter().enumerate().map(|(i, rate)| (i, rate * state.species[s][i].signum()));
        let (point, rate) = each.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((s, point, rate / chemistry.typical(s)))
    };
    let fastest = (0..rates.len()).filter_map(largest).max_by(|a, b| a.2.total_cmp(&b.2));
    let Some((s, point, _)) = fastest else { return Ok(None) };
    let (c, rate) = (state.species[s][point], rates[s][point]);
    if !(rate * c > 0.0) {
        return Ok(None);
    }
    let soon =
        if c.abs() > BLOW_UP_RATIO * chemistry.typical(s) { BLOW_UP_TIME_SHARE } else { AT_ONCE };
    let step = PROBE_CHANGE * c / rate;
    let mut later = state.clone();
    for (values, rates) in later.species.iter_mut().zip(&rates) {
        values.iter_mut().zip(rates).for_each(|(c, rate)| *c += step * rate);
    }
    let change = (workspace.at(&later).rates()?[s][point] - rate) / step;
    let left = 1.0 / (change / rate - rate / c);
    if !(left > 0.0 && left < soon * state.time.abs()) {
        return Ok(None);
    }
    Ok(Some(Diagnosis {
        reason: Reason::Chemistry,
        text: format!(
            "species `{}` blows up in finite time: at {} {point} it is {c:.3e} and its growth accelerates, with a singularity near time {:.6}, \
             from where on its equation has no solution",
            species[s].name,
            chemistry.location().noun(),
            state.time + left
        ),
        advice: "a law whose rate levels off, or an end before that time (time.until)".into(),
    }))
}

/// Coefficients of diffusion and cross-diffusion with which short waves grow without bound at the species of `state`.
#[must_use]
pub fn ill_posed(model: &Model, state: &State) -> Option<Diagnosis> {
    let found = model.chemistry()?.ill_posed_at(model.sheet(), &state.species)?;
    Some(Diagnosis {
        reason: Reason::Chemistry,
        text: found.to_string(),
        advice: "coefficients whose matrix has eigenvalues with real parts from 0 on at all species that occur; of two species u and v: \
                 D_u D_v from D_uv D_vu on"
            .into(),
    })
}

/// The longest fixed explicit step that diffusion allows on the shape of `state`; none without diffusion.
///
/// # Errors
/// If the model has no value there.
pub fn explicit_limit(workspace: &mut Workspace, state: &State) -> Result<Option<f64>> {
    let model = Arc::clone(&workspace.model);
    let Some(chemistry) = model.chemistry() else { return Ok(None) };
    let mut at = workspace.at(state);
    let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
    let signals = at.signals()?.clone();
    let inputs = (&species[..], chemistry.signal_values(&signals));
    let bound = chemistry.transport_bound((model.sheet(), state.time), at.surface(), inputs);
    Ok((bound > 0.0).then(|| 2.0 / bound))
}

/// What to say of a fixed explicit step beyond that.
#[must_use]
pub fn explicit_limit_message(step: f64, limit: f64) -> Diagnosis {
    Diagnosis {
        reason: Reason::Chemistry,
        text: format!(
            "explicit Euler steps of {} are longer than diffusion allows on this mesh: they are stable up to about {limit:.2e}, \
             and beyond it short waves grow from step to step",
            Short(step)
        ),
        advice: "a shorter step, or integrator = \"staggered\" with chemistry = \"chebyshev\" (its default), whose steps \
                 diffusion does not limit"
            .into(),
    }
}
