//! Curves over time and marks in a plane, as PNG and as SVG.

mod axis;

use std::ops::Range;

use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::OutputError;
use super::picture::Picture;
use axis::{Axis, range, reached, ticks};
use rumple_numerics::num::index;

/// A named row of points; one point alone is drawn as a mark.
///
/// Points that an axis does not reach (infinite ones, and those from 0 down on a logarithmic axis)
/// are left out of a row. A point alone is then a triangle at the edge, towards where it lies, or a
/// cross in the corner if both of its numbers are infinite.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Which of the names of the figure it belongs to.
    pub name: usize,
    /// Across and up; NaN is left out.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Panel {
    /// What is drawn upwards.
    pub title: String,
    /// What is drawn to the right.
    pub across: String,
    /// Whether the axes are logarithmic: across, up.
    pub logarithmic: (bool, bool),
    /// The curves.
    pub curves: Vec<Curve>,
    /// What has a place across and no value: which of the names, and where. Crosses at the upper edge.
    pub failed: Vec<(usize, f64)>,
    /// What is 0, where the axis up is logarithmic: which of the names, and where. Triangles at the lower edge.
    pub zeros: Vec<(usize, f64)>,
}

/// The shape of marks that stand alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A triangle that points up.
    Triangle,
    /// A square.
    Square,
    /// A square on its corner.
    Diamond,
}

impl Mark {
    /// Its corners around a point, in pixels to the right and down.
    fn corners(self) -> Vec<(i32, i32)> {
        match self {
            Self::Triangle => vec![(0, -8), (7, 5), (-7, 5)],
            Self::Square => vec![(-5, -5), (5, -5), (5, 5), (-5, 5)],
            Self::Diamond => vec![(0, -8), (8, 0), (0, 8), (-8, 0)],
        }
    }
}

/// How the points of a name are drawn.
enum Style {
    Line,
    Guide(usize),
    Mark(Mark),
}

impl Style {
    /// Draws `points` in `chart`; a line of this colour and so many pixels broader than others.
    fn draw<B: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, B>,
        points: &[(f64, f64)],
        (colour, broader): (PaletteColor<Palette99>, u32),
    ) -> Result<(), OutputError> {
        match self {
            Self::Line => {
                let style = colour.stroke_width(2 + broader);
                // Piece by piece: a corner of a whole line would end in a spike where it is sharp.
                let piece = |ends: &[(f64, f64)]| PathElement::new(ends.to_vec(), style);
                chart.draw_series(points.windows(2).map(piece)).map_err(refused)?;
                let radius = if points.len() == 1 { 6 } else { 3 + broader };
                let mark = |at: &(f64, f64)| Circle::new(*at, radius, colour.filled());
                chart.draw_series(points.iter().map(mark)).map_err(refused)?;
            }
            Self::Guide(guide) => {
                let (style, dash, gap) = dashed(*guide);
                let line = DashedLineSeries::new(points.to_vec(), dash, gap, style);
                chart.draw_series(line).map_err(refused)?;
            }
            Self::Mark(mark) => {
                let mark = |at: &(f64, f64)| {
                    EmptyElement::at(*at) + Polygon::new(mark.corners(), BLACK.filled())
                };
                chart.draw_series(points.iter().map(mark)).map_err(refused)?;
            }
        }
        Ok(())
    }
}

/// Panels side by side with one legend.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Figure {
    /// Names in the legend, which leaves empty ones out.
    pub names: Vec<String>,
    /// How many of the names, the last ones, are of lines to compare with: grey and dashed, without marks.
    pub guides: usize,
    /// Names whose points stand alone, with the shape of their marks, black.
    pub marks: Vec<(usize, Mark)>,
    /// Panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
}

pub(super) const FONT: &str = "sans-serif";
const PANEL_SIZE: (usize, usize) = (480, 340);
const LINE_HEIGHT: usize = 22;

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

/// Colour, dash and gap of guide number `guide`.
fn dashed(guide: usize) -> (ShapeStyle, i32, i32) {
    let (grey, dash, gap) = [(60, 12, 6), (130, 3, 4), (170, 20, 4)][guide % 3];
    (RGBColor(grey, grey, grey).stroke_width(2), dash, gap)
}

impl Figure {
    /// How a name is drawn; guides by their numbers.
    fn style(&self, name: usize) -> Style {
        match name.checked_sub(self.names.len().saturating_sub(self.guides)) {
            Some(guide) => Style::Guide(guide),
            None => {
                let mark = self.marks.iter().find(|(marked, _)| *marked == name);
                mark.map_or(Style::Line, |(_, mark)| Style::Mark(*mark))
            }
        }
    }

    /// What the legend has: every curve, and the guides that are drawn.
    fn shown(&self) -> Vec<usize> {
        let drawn = |k: usize| {
            let mut curves = self.panels.iter().flat_map(|panel| &panel.curves);
            curves.any(|curve| curve.name == k && !curve.points.is_empty())
        };
        let guide = |k: usize| matches!(self.style(k), Style::Guide(_));
        let named = |k: &usize| !self.names[*k].is_empty();
        (0..self.names.len()).filter(named).filter(|k| !guide(*k) || drawn(*k)).collect()
    }

    fn size(&self) -> (usize, usize) {
        let rows = self.panels.len().div_ceil(self.columns.max(1));
        (
            PANEL_SIZE.0 * self.columns.max(1),
            PANEL_SIZE.1 * rows + LINE_HEIGHT * self.shown().len() + 12,
        )
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

    fn draw<B: DrawingBackend>(&self, area: &Area<B>) -> Result<(), OutputError> {
        area.fill(&WHITE).map_err(refused)?;
        let rows = self.panels.len().div_ceil(self.columns.max(1));
        let (panels, legend) = area.split_vertically(index(PANEL_SIZE.1 * rows));
        for (panel, area) in self.panels.iter().zip(panels.split_evenly((rows, self.columns))) {
            panel.draw(&area, &|name| self.style(name))?;
        }
        for (row, k) in self.shown().into_iter().enumerate() {
            let y = i32::try_from(row * LINE_HEIGHT + LINE_HEIGHT / 2).unwrap_or(0);
            let ends = [(20, y), (50, y)];
            match self.style(k) {
                Style::Line => legend.draw(&PathElement::new(ends, colour(k).stroke_width(3))),
                Style::Guide(guide) => {
                    let (style, dash, gap) = dashed(guide);
                    legend.draw(&DashedPathElement::new(ends, dash, gap, style))
                }
                Style::Mark(mark) => {
                    let corners = mark.corners().into_iter().map(|(x, down)| (x + 35, y + down));
                    legend.draw(&Polygon::new(corners.collect::<Vec<_>>(), BLACK.filled()))
                }
            }
            .map_err(refused)?;
            let text = Text::new(self.names[k].clone(), (60, y - 8), (FONT, 15).into_font());
            legend.draw(&text).map_err(refused)?;
        }
        area.present().map_err(refused)
    }
}

/// Where it is drawn: pixels or SVG.
type Area<B> = DrawingArea<B, plotters::coord::Shift>;
type Chart<'a, B> = ChartContext<'a, B, Cartesian2d<Axis, Axis>>;

/// How a name is drawn.
type Styles<'a> = &'a dyn Fn(usize) -> Style;

impl Panel {
    fn draw<B: DrawingBackend>(
        &self,
        area: &Area<B>,
        styles: Styles<'_>,
    ) -> Result<(), OutputError> {
        let (across, up) = self.logarithmic;
        let all = || self.curves.iter().flat_map(|c| c.known(self.logarithmic));
        let marks = || self.failed.iter().chain(&self.zeros);
        let crosses = || marks().map(|(_, x)| *x).filter(|x| reached(*x, across));
        if all().next().is_none() && crosses().next().is_none() {
            let text = format!("{}: nothing to show", self.title);
            let text = Text::new(text, (20, 20), (FONT, 15).into_font());
            return area.draw(&text).map_err(refused);
        }
        let places = all().map(|p| p.0).filter(|v| reached(*v, across));
        let x = range(places.chain(crosses()), across);
        let y = range(all().map(|p| p.1).filter(|v| reached(*v, up)), up);
        let edges = (x.clone(), y.clone());
        let log = |range: Range<f64>| {
            let ticks = ticks(&range);
            range.log_scale().with_key_points(ticks)
        };
        let axis = |range: Range<f64>, logarithmic| {
            if logarithmic { Axis::Logarithmic(log(range)) } else { Axis::Linear(range.into()) }
        };
        self.on(area, (axis(x, across), axis(y, up)), &edges, styles)
    }

    fn on<B: DrawingBackend>(
        &self,
        area: &Area<B>,
        (x, y): (Axis, Axis),
        edges: &(Range<f64>, Range<f64>),
        styles: Styles<'_>,
    ) -> Result<(), OutputError> {
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
            .x_label_formatter(&|v| tick(*v, &edges.0, across))
            .y_label_formatter(&|v| tick(*v, &edges.1, up))
            .draw()
            .map_err(refused)?;
        let mut crosses = 0;
        for (number, Curve { name, points }) in self.curves.iter().enumerate() {
            let seen = |p: &&(f64, f64)| reached(p.0, across) && reached(p.1, up);
            if let [(x, y)] = points[..]
                && !(x.is_nan() || y.is_nan() || reached(x, across) && reached(y, up))
            {
                let inside = |v: f64, edge: &Range<f64>| v.clamp(edge.start, edge.end);
                let at = (inside(x, &edges.0), inside(y, &edges.1));
                // Crosses share a corner: side by side.
                let cross = x == f64::INFINITY && y == f64::INFINITY;
                let shift = if cross { CROSS_SPACING * crosses } else { 0 };
                crosses += i32::from(cross);
                let style = colour(*name).filled();
                let corners = if cross { CROSS_OUTLINE } else { triangle(at, (x, y)) };
                let corners = corners.iter().map(|(x, y)| (x - shift, *y)).collect::<Vec<_>>();
                let mark = EmptyElement::at(at) + Polygon::new(corners, style);
                chart.draw_series([mark]).map_err(refused)?;
                continue;
            }
            let points: Vec<(f64, f64)> = points.iter().filter(seen).copied().collect();
            // Earlier curves are broader: they show beside later ones that cover them.
            let broader = index(4 * (self.curves.len() - 1 - number) / self.curves.len());
            styles(*name).draw(&mut chart, &points, (colour(*name), broader))?;
        }
        self.marks(&mut chart, edges)
    }

    /// Marks errors of 0 on the lower edge and failed runs on the upper one.
    fn marks<B: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, B>,
        edges: &(Range<f64>, Range<f64>),
    ) -> Result<(), OutputError> {
        let across = self.logarithmic.0;
        let down = triangle((0.0, 0.0), (0.0, -1.0));
        for (name, x) in self.zeros.iter().filter(|(_, x)| reached(*x, across)) {
            let mark = EmptyElement::at((*x, edges.1.start))
                + Polygon::new(down.to_vec(), colour(*name).filled());
            chart.draw_series([mark]).map_err(refused)?;
        }
        let mut before: Vec<f64> = Vec::new();
        for (name, x) in self.failed.iter().filter(|(_, x)| reached(*x, across)) {
            // Those at one place lie below one another.
            let lower =
                CROSS_SPACING * before.iter().filter(|b| *b == x).count().try_into().unwrap_or(0);
            before.push(*x);
            let corners: Vec<_> = CROSS_OUTLINE.iter().map(|(x, y)| (x + 10, y + lower)).collect();
            let mark =
                EmptyElement::at((*x, edges.1.end)) + Polygon::new(corners, colour(*name).filled());
            chart.draw_series([mark]).map_err(refused)?;
        }
        Ok(())
    }
}

impl Curve {
    /// Points that are somewhere in the panel.
    fn known(&self, (across, up): (bool, bool)) -> impl Iterator<Item = (f64, f64)> {
        let alone = self.points.len() == 1;
        let shown = move |p: &&(f64, f64)| {
            let seen = reached(p.0, across) && reached(p.1, up);
            seen || alone && !p.0.is_nan() && !p.1.is_nan()
        };
        self.points.iter().filter(shown).copied()
    }
}

/// Pixels from one cross to the next.
const CROSS_SPACING: i32 = 18;

/// The outline of a cross, in pixels to the right and down, inside of an upper right corner.
const CROSS_OUTLINE: &[(i32, i32)] = &[
    (-16, 6),
    (-14, 4),
    (-10, 8),
    (-6, 4),
    (-4, 6),
    (-8, 10),
    (-4, 14),
    (-6, 16),
    (-10, 12),
    (-14, 16),
    (-16, 14),
    (-12, 10),
];

/// A triangle at the edge `at` that points to `(x, y)` outside, in pixels to the right and down.
fn triangle(at: (f64, f64), (x, y): (f64, f64)) -> &'static [(i32, i32)] {
    if y < at.1 {
        &[(0, 0), (-7, -12), (7, -12)]
    } else if y > at.1 {
        &[(0, 0), (-7, 12), (7, 12)]
    } else if x < at.0 {
        &[(0, 0), (12, -7), (12, 7)]
    } else {
        &[(0, 0), (-12, -7), (-12, 7)]
    }
}

/// The label of a tick; 0 where that is meant, and round-off is left of it.
fn tick(value: f64, range: &Range<f64>, logarithmic: bool) -> String {
    let round_off = 1e-9 * (range.end - range.start);
    label(if !logarithmic && value.abs() < round_off { 0.0 } else { value })
}

/// A number in few digits, with a power of ten where it is large or small.
#[must_use]
pub fn label(value: f64) -> String {
    let size = value.abs();
    if size >= 1e5 || (size > 0.0 && size < 1e-3) {
        let text = format!("{value:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        format!("{digits}e{power}")
    } else {
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}
