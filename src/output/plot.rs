//! Curves over time and marks in a plane, as PNG and as SVG.

use std::ops::Range;

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use super::OutputError;
use super::picture::Picture;
use crate::num::index;

/// A named row of points; one point alone is drawn as a mark.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Which of the names of the figure it belongs to.
    pub name: usize,
    /// Points; those that are not finite, or not positive on a logarithmic axis, are left out.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What is drawn upwards.
    pub title: String,
    /// What is drawn to the right.
    pub across: String,
    /// Whether the axes are logarithmic: across, up.
    pub logarithmic: (bool, bool),
    /// The curves.
    pub curves: Vec<Curve>,
}

/// Panels side by side with one legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Names in the legend.
    pub names: Vec<String>,
    /// Panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
}

pub(super) const FONT: &str = "sans-serif";
const PANEL: (usize, usize) = (480, 340);
const LINE: usize = 22;

/// Makes the font known, once.
pub(super) fn register() -> Result<(), OutputError> {
    plotters::style::register_font(FONT, FontStyle::Normal, dejavu::sans::regular())
        .map_err(|_| OutputError::Picture("the font is not readable".into()))
}

fn refused<E: std::fmt::Display>(error: E) -> OutputError {
    OutputError::Picture(error.to_string())
}

fn colour(name: usize) -> PaletteColor<Palette99> {
    Palette99::pick(name)
}

impl Figure {
    fn size(&self) -> (usize, usize) {
        let rows = self.panels.len().div_ceil(self.columns.max(1));
        (PANEL.0 * self.columns.max(1), PANEL.1 * rows + LINE * self.names.len() + 12)
    }

    /// As a picture of pixels.
    ///
    /// # Errors
    /// If nothing can be drawn in it.
    pub fn picture(&self) -> Result<Picture, OutputError> {
        register()?;
        let (width, height) = self.size();
        let mut picture = Picture::blank(width, height);
        {
            let size = (index(width), index(height));
            let backend = BitMapBackend::with_buffer(picture.rgb_mut(), size);
            self.draw(&backend.into_drawing_area())?;
        }
        Ok(picture)
    }

    /// As the text of an SVG file.
    ///
    /// # Errors
    /// If nothing can be drawn in it.
    pub fn svg(&self) -> Result<String, OutputError> {
        register()?;
        let (width, height) = self.size();
        let mut text = String::new();
        {
            let backend = SVGBackend::with_string(&mut text, (index(width), index(height)));
            self.draw(&backend.into_drawing_area())?;
        }
        Ok(text)
    }

    fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, plotters::coord::Shift>,
    ) -> Result<(), OutputError> {
        area.fill(&WHITE).map_err(refused)?;
        let rows = self.panels.len().div_ceil(self.columns.max(1));
        let (panels, legend) = area.split_vertically(index(PANEL.1 * rows));
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((rows, self.columns))) {
            panel.draw(&area)?;
        }
        for (k, name) in self.names.iter().enumerate() {
            let y = i32::try_from(k * LINE + LINE / 2).unwrap_or(0);
            let line = PathElement::new(vec![(20, y), (50, y)], colour(k).stroke_width(3));
            legend.draw(&line).map_err(refused)?;
            let text = Text::new(name.clone(), (60, y - 8), (FONT, 15).into_font());
            legend.draw(&text).map_err(refused)?;
        }
        area.present().map_err(refused)
    }
}

impl Panel {
    /// Points that can be shown, curve by curve.
    fn shown(&self) -> Vec<(usize, Vec<(f64, f64)>)> {
        let good = |v: f64, log: bool| v.is_finite() && (!log || v > 0.0);
        let (x, y) = self.logarithmic;
        let visible = |p: &&(f64, f64)| good(p.0, x) && good(p.1, y);
        let points = |c: &Curve| c.points.iter().filter(visible).copied().collect();
        self.curves.iter().map(|c| (c.name, points(c))).collect()
    }

    fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, plotters::coord::Shift>,
    ) -> Result<(), OutputError> {
        let curves = self.shown();
        let all = || curves.iter().flat_map(|(_, points)| points.iter());
        if all().next().is_none() {
            let text = format!("{}: nothing to show", self.title);
            let text = Text::new(text, (20, 20), (FONT, 15).into_font());
            return area.draw(&text).map_err(refused);
        }
        let x = range(all().map(|p| p.0), self.logarithmic.0);
        let y = range(all().map(|p| p.1), self.logarithmic.1);
        match self.logarithmic {
            (false, false) => self.on(area, x, y, &curves),
            (false, true) => self.on(area, x, y.log_scale(), &curves),
            (true, false) => self.on(area, x.log_scale(), y, &curves),
            (true, true) => self.on(area, x.log_scale(), y.log_scale(), &curves),
        }
    }

    fn on<DB: DrawingBackend, X, Y>(
        &self,
        area: &DrawingArea<DB, plotters::coord::Shift>,
        x: X,
        y: Y,
        curves: &[(usize, Vec<(f64, f64)>)],
    ) -> Result<(), OutputError>
    where
        X: AsRangedCoord<Value = f64>,
        Y: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .caption(&self.title, (FONT, 17))
            .x_label_area_size(40)
            .y_label_area_size(70)
            .build_cartesian_2d(x, y)
            .map_err(refused)?;
        let across = self.logarithmic.0;
        let up = self.logarithmic.1;
        chart
            .configure_mesh()
            .x_desc(self.across.as_str())
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .light_line_style(RGBColor(240, 240, 240))
            .x_labels(6)
            .y_labels(6)
            .x_label_formatter(&|v| label(*v, across))
            .y_label_formatter(&|v| label(*v, up))
            .draw()
            .map_err(refused)?;
        for (name, points) in curves {
            let line = LineSeries::new(points.iter().copied(), colour(*name).stroke_width(2));
            chart.draw_series(line).map_err(refused)?;
            let radius = if points.len() == 1 { 6 } else { 3 };
            let marks = points.iter().map(|p| Circle::new(*p, radius, colour(*name).filled()));
            chart.draw_series(marks).map_err(refused)?;
        }
        Ok(())
    }
}

/// A number in few digits, with a power of ten where it is large or small, or `always`.
#[must_use]
pub fn label(value: f64, always: bool) -> String {
    let size = value.abs();
    if always || size >= 1e5 || (size > 0.0 && size < 1e-3) {
        let text = format!("{value:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        format!("{digits}e{power}")
    } else {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

/// The range of `values` with some room around it.
fn range(values: impl Iterator<Item = f64>, logarithmic: bool) -> Range<f64> {
    let (least, most) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)));
    if logarithmic {
        (least / 1.5).max(f64::MIN_POSITIVE)..(most * 1.5).min(f64::MAX)
    } else {
        let room = 0.05 * (most - least);
        let room = if room > 0.0 { room } else { 0.5 * most.abs().max(1e-3) };
        least - room..most + room
    }
}
