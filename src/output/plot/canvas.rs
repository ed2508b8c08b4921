//! Pixels or SVG behind one type, so that everything that draws is compiled once.

use plotters::prelude::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind,
};

/// Where it is drawn.
pub(super) enum Canvas<'a> {
    Pixels(BitMapBackend<'a>),
    Svg(SVGBackend<'a>),
}

type Refusal = DrawingErrorKind<std::io::Error>;

fn io<E: std::error::Error + Send + Sync + 'static>(error: DrawingErrorKind<E>) -> Refusal {
    match error {
        DrawingErrorKind::DrawingError(e) => {
            DrawingErrorKind::DrawingError(std::io::Error::other(e))
        }
        DrawingErrorKind::FontError(e) => DrawingErrorKind::FontError(e),
    }
}

macro_rules! on {
    ($self:ident, $canvas:ident => $call:expr) => {
        match $self {
            Self::Pixels($canvas) => $call.map_err(io),
            Self::Svg($canvas) => $call.map_err(io),
        }
    };
}

impl DrawingBackend for Canvas<'_> {
    type ErrorType = std::io::Error;

    fn get_size(&self) -> (u32, u32) {
        match self {
            Self::Pixels(c) => c.get_size(),
            Self::Svg(c) => c.get_size(),
        }
    }
    fn ensure_prepared(&mut self) -> Result<(), Refusal> {
        on!(self, c => c.ensure_prepared())
    }
    fn present(&mut self) -> Result<(), Refusal> {
        on!(self, c => c.present())
    }
    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Result<(), Refusal> {
        on!(self, c => c.draw_pixel(at, colour))
    }
    fn draw_line<S: BackendStyle>(
        &mut self,
        a: BackendCoord,
        b: BackendCoord,
        style: &S,
    ) -> Result<(), Refusal> {
        on!(self, c => c.draw_line(a, b, style))
    }
    fn draw_rect<S: BackendStyle>(
        &mut self,
        a: BackendCoord,
        b: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Result<(), Refusal> {
        on!(self, c => c.draw_rect(a, b, style, fill))
    }
    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Result<(), Refusal> {
        let path: Vec<_> = path.into_iter().collect();
        on!(self, c => c.draw_path(path, style))
    }
    fn draw_circle<S: BackendStyle>(
        &mut self,
        at: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Result<(), Refusal> {
        on!(self, c => c.draw_circle(at, radius, style, fill))
    }
    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Result<(), Refusal> {
        let path: Vec<_> = path.into_iter().collect();
        on!(self, c => c.fill_polygon(path, style))
    }
    fn draw_text<T: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &T,
        at: BackendCoord,
    ) -> Result<(), Refusal> {
        on!(self, c => c.draw_text(text, style, at))
    }
    fn estimate_text_size<T: BackendTextStyle>(
        &self,
        text: &str,
        style: &T,
    ) -> Result<(u32, u32), Refusal> {
        on!(self, c => c.estimate_text_size(text, style))
    }
    fn blit_bitmap(
        &mut self,
        at: BackendCoord,
        size: (u32, u32),
        from: &[u8],
    ) -> Result<(), Refusal> {
        on!(self, c => c.blit_bitmap(at, size, from))
    }
}
