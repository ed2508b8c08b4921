//! Plots of values against one of the keys of a study.

use super::{combinations, selected};
use crate::num::real;
use crate::output::plot::{Curve, Figure, Panel};
use crate::study::gather::Statistics;
use crate::study::plan::Plan;

/// Curves against axis number `axis` of a plan: one for every combination of values of the axes that `curve_axes` holds of.
pub struct StudyPlot<F> {
    axis: usize,
    curve_axes: F,
    curves: Vec<(Vec<usize>, String)>,
    /// Where the values of the axis are drawn: at themselves, or at 1, 2, … if they are not numbers.
    pub places: Vec<f64>,
}

impl<F: Fn(usize) -> bool + Copy> StudyPlot<F> {
    pub fn new(plan: &Plan, axis: usize, curve_axes: F) -> Self {
        let drawn = &plan.axes[axis];
        let places =
            drawn.numbers().unwrap_or_else(|| (1..=drawn.values.len()).map(real).collect());
        Self { axis, curve_axes, curves: combinations(plan, curve_axes), places }
    }

    /// Curve and x of a run with the values `at` of the axes.
    pub fn curve_and_x(&self, at: &[usize]) -> Option<(usize, f64)> {
        let kept = selected(at, self.curve_axes);
        let curve = self.curves.iter().position(|(known, _)| *known == kept)?;
        Some((curve, *self.places.get(*at.get(self.axis)?)?))
    }

    /// A curve through the means of `values` for every combination; marks for all of them where a mean is of several.
    pub fn curves<'a>(&self, values: impl Iterator<Item = (&'a [usize], f64)>) -> Vec<Curve> {
        let mut points: Vec<Vec<(f64, Vec<f64>)>> = vec![Vec::new(); self.curves.len()];
        for (at, y) in values {
            let Some((name, x)) = self.curve_and_x(at) else { continue };
            match points[name].iter_mut().find(|(at, _)| *at == x) {
                Some((_, values)) => values.push(y),
                None => points[name].push((x, vec![y])),
            }
        }
        let (mut means, mut marks) = (Vec::new(), Vec::new());
        for (name, mut points) in points.into_iter().enumerate().filter(|(_, p)| !p.is_empty()) {
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            if points.iter().any(|(_, values)| values.len() > 1) {
                let all = points.iter().flat_map(|(x, values)| values.iter().map(|y| (*x, *y)));
                marks.extend(all.map(|point| Curve { name, points: vec![point] }));
            }
            let mean = |(x, values): &(f64, Vec<f64>)| Some((*x, Statistics::of(values).mean?));
            means.push(Curve { name, points: points.iter().filter_map(mean).collect() });
        }
        means.extend(marks);
        means
    }

    /// `panels` with the names of the curves; `only_name` where there is one for all.
    pub fn figure(self, only_name: &str, panels: Vec<Panel>) -> Figure {
        let name =
            |(_, name): (Vec<usize>, String)| if name.is_empty() { only_name.into() } else { name };
        let names = self.curves.into_iter().map(name).collect();
        Figure { names, guides: 0, marks: Vec::new(), panels }
    }
}
