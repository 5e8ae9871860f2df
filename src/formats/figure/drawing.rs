//! A picture as a list of shapes, written as PNG or as SVG.
//!
//! The only file that knows the rasteriser, the font and the PNG encoder. Lengths are in pixels
//! of the PNG; x runs right and y down from the top left corner. The same list gives the same
//! bytes on every run.

use std::fmt::Write;
use std::iter::repeat_n;

use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};
use thiserror::Error;
use tiny_skia::{FillRule, Paint, Path, PathBuilder, PathSegment, Pixmap, Stroke, Transform};

use crate::formats::base64::base64;
use crate::formats::xml::escaped;

/// Pixels per metre of paper written into the PNG: 200 per inch.
const PIXELS_PER_M: u32 = 7874;

/// The longest side that is still drawn, px.
const MAX_SIDE_PX: f32 = 16_384.0;

/// A colour: red, green and blue, 0 to 255 (sRGB).
pub type Rgb = [u8; 3];

/// A point of the page: x to the right and y down, px.
pub type Point = (f32, f32);

/// A page and what is on it, in the order of painting.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Width of the white page, px; the PNG rounds it up.
    pub width_px: f32,
    /// Height of the white page, px; the PNG rounds it up.
    pub height_px: f32,
    /// The shapes, from the lowest to the topmost.
    pub shapes: Vec<Shape>,
}

/// One thing on the page.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A filled polygon.
    Area {
        /// Corners in order; the last is joined to the first.
        corners: Vec<Point>,
        /// Colour of the inside.
        colour: Rgb,
    },
    /// A line through points.
    Line {
        /// The points in order.
        points: Vec<Point>,
        /// Colour of the line.
        colour: Rgb,
        /// Thickness, px.
        thickness_px: f32,
    },
    /// A grid of square cells, each painted exactly and without smoothing.
    Cells {
        /// Left edge of the first column, px.
        left_px: u32,
        /// Upper edge of the first row, px.
        top_px: u32,
        /// Side of a cell, px.
        cell_px: u32,
        /// Number of columns.
        columns: usize,
        /// Colours, row by row from the top.
        colours: Vec<Rgb>,
    },
    /// A line of text.
    Text(Text),
}

impl Drawing {
    /// This page with another one to its right.
    pub fn beside(mut self, mut right: Drawing) -> Drawing {
        let by_px = self.width_px.ceil();
        right.shapes.iter_mut().for_each(|shape| shape.shift((by_px, 0.0)));
        self.shapes.append(&mut right.shapes);
        Drawing {
            width_px: by_px + right.width_px,
            height_px: self.height_px.max(right.height_px),
            shapes: self.shapes,
        }
    }

    /// This page with another one below it.
    pub fn above(mut self, mut below: Drawing) -> Drawing {
        let by_px = self.height_px.ceil();
        below.shapes.iter_mut().for_each(|shape| shape.shift((0.0, by_px)));
        self.shapes.append(&mut below.shapes);
        Drawing {
            width_px: self.width_px.max(below.width_px),
            height_px: by_px + below.height_px,
            shapes: self.shapes,
        }
    }

    /// Pages in rows of `columns` pages, from the upper left.
    pub fn grid(pages: &[Drawing], columns: usize) -> Drawing {
        let mut grid = Drawing::default();
        for row in pages.chunks(columns.max(1)) {
            grid = grid.above(row.iter().cloned().fold(Drawing::default(), Self::beside));
        }
        grid
    }
}

impl Shape {
    /// By whole pixels.
    fn shift(&mut self, (right_px, down_px): Point) {
        let shift = |point: &mut Point| *point = (point.0 + right_px, point.1 + down_px);
        match self {
            Shape::Area { corners: points, .. } | Shape::Line { points, .. } => {
                points.iter_mut().for_each(shift);
            }
            Shape::Cells { left_px, top_px, .. } => {
                *left_px += right_px as u32;
                *top_px += down_px as u32;
            }
            Shape::Text(text) => shift(&mut text.at),
        }
    }
}

/// A line of text on the page.
#[derive(Clone, Debug, PartialEq)]
pub struct Text {
    /// What is written.
    pub text: String,
    /// The point of the base line that `anchor` names.
    pub at: Point,
    /// Which part of the text stands at that point.
    pub anchor: Anchor,
    /// Font size, px.
    pub size_px: f32,
    /// Thickness of the letters.
    pub weight: Weight,
    /// Colour of the letters.
    pub colour: Rgb,
    /// Written from bottom to top.
    pub upwards: bool,
}

/// Which part of a text stands at its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// Its beginning.
    Start,
    /// Its middle.
    Middle,
    /// Its end.
    End,
}

/// How heavy the letters are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    /// For labels.
    Regular,
    /// For titles.
    SemiBold,
}

/// Why a drawing gave no PNG.
#[derive(Debug, Error)]
pub enum DrawingError {
    /// The page has no area or is beyond what can be drawn.
    #[error("draw a page of {width_px} × {height_px} px: sides go from 1 to {MAX_SIDE_PX} px")]
    Page {
        /// Width asked for, px.
        width_px: f32,
        /// Height asked for, px.
        height_px: f32,
    },
    /// The encoder refused.
    #[error("encode a png: {0}")]
    Encode(#[from] png::EncodingError),
}

impl Drawing {
    /// The drawing as the bytes of a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, DrawingError> {
        let mut page = self.blank_page()?;
        for shape in &self.shapes {
            paint(&mut page, shape);
        }
        let rgb: Vec<u8> =
            page.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        Ok(encode(page.width(), page.height(), &rgb)?)
    }

    /// The drawing as the text of an SVG file; pixels and letters keep their exact shape.
    pub fn svg(&self) -> Result<String, DrawingError> {
        let (width, height) = (self.width_px, self.height_px);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
        );
        for shape in &self.shapes {
            svg += &element(shape)?;
        }
        Ok(svg + "</svg>\n")
    }

    fn blank_page(&self) -> Result<Pixmap, DrawingError> {
        let (width_px, height_px) = (self.width_px.ceil(), self.height_px.ceil());
        let sides_px = 1.0..=MAX_SIDE_PX;
        if !(sides_px.contains(&width_px) && sides_px.contains(&height_px)) {
            return Err(DrawingError::Page { width_px, height_px });
        }
        let page = Pixmap::new(width_px as u32, height_px as u32);
        let mut page = page.ok_or(DrawingError::Page { width_px, height_px })?;
        page.fill(tiny_skia::Color::WHITE);
        Ok(page)
    }
}

/// Length of a line of text, px.
pub fn text_width_px(text: &str, size_px: f32, weight: Weight) -> f32 {
    let font = font(weight);
    let units: f32 = text.chars().map(|letter| advance(&font, glyph(&font, letter))).sum();
    units * size_px / units_per_em(&font)
}

fn font(weight: Weight) -> FontRef<'static> {
    let font: &[u8] = match weight {
        Weight::Regular => include_bytes!("../../../assets/inter/Inter-Regular.otf"),
        Weight::SemiBold => include_bytes!("../../../assets/inter/Inter-SemiBold.otf"),
    };
    FontRef::new(font).expect("the fonts in assets/ are valid")
}

/// For outlines and widths in the font's own units.
fn own_units() -> (Size, LocationRef<'static>) {
    (Size::unscaled(), LocationRef::default())
}

fn units_per_em(font: &FontRef) -> f32 {
    let (size, location) = own_units();
    f32::from(font.metrics(size, location).units_per_em)
}

fn glyph(font: &FontRef, letter: char) -> GlyphId {
    font.charmap().map(letter).unwrap_or_default()
}

fn advance(font: &FontRef, glyph: GlyphId) -> f32 {
    let (size, location) = own_units();
    font.glyph_metrics(size, location).advance_width(glyph).unwrap_or(0.0)
}

fn paint(page: &mut Pixmap, shape: &Shape) {
    match shape {
        Shape::Area { corners, colour } => {
            if let Some(path) = path(corners, true) {
                fill(page, &path, *colour, Transform::identity());
            }
        }
        Shape::Line { points, colour, thickness_px } => {
            let stroke = Stroke { width: *thickness_px, ..Stroke::default() };
            if let Some(path) = path(points, false) {
                page.stroke_path(&path, &ink(*colour), &stroke, Transform::identity(), None);
            }
        }
        Shape::Cells { left_px, top_px, cell_px, columns, colours } => {
            paint_cells(page, (*left_px, *top_px), *cell_px, *columns, colours);
        }
        Shape::Text(text) => paint_text(page, text),
    }
}

fn ink(colour: Rgb) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(colour[0], colour[1], colour[2], 255);
    paint
}

fn fill(page: &mut Pixmap, path: &Path, colour: Rgb, transform: Transform) {
    page.fill_path(path, &ink(colour), FillRule::Winding, transform, None);
}

fn path(points: &[Point], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    let (&(x, y), rest) = points.split_first()?;
    path.move_to(x, y);
    rest.iter().for_each(|&(x, y)| path.line_to(x, y));
    if closed {
        path.close();
    }
    path.finish()
}

/// Writes the pixels themselves: no smoothing, no seams.
fn paint_cells(page: &mut Pixmap, corner: (u32, u32), cell: u32, columns: usize, cells: &[Rgb]) {
    let (left, top) = (corner.0.min(page.width()) as usize, corner.1 as usize);
    let stride = 4 * page.width() as usize;
    let lines = page.data_mut().chunks_exact_mut(stride).skip(top);
    for (line, row) in lines.zip(pixel_rows(cells, columns, cell)) {
        for (pixel, colour) in line[4 * left..].chunks_exact_mut(4).zip(row) {
            pixel[..3].copy_from_slice(colour);
        }
    }
}

/// Rows of pixels that show each cell as a square of `cell` × `cell` pixels.
fn pixel_rows(
    cells: &[Rgb],
    columns: usize,
    cell: u32,
) -> impl Iterator<Item = impl Iterator<Item = &Rgb>> {
    let cell = cell as usize;
    let rows = cells.chunks_exact(columns.max(1)).flat_map(move |row| repeat_n(row, cell));
    rows.map(move |row| row.iter().flat_map(move |colour| repeat_n(colour, cell)))
}

fn paint_text(page: &mut Pixmap, text: &Text) {
    let (x, y) = text.at;
    let turn_deg = if text.upwards { -90.0 } else { 0.0 };
    if let Some(letters) = letters(text) {
        fill(page, &letters, text.colour, Transform::from_translate(x, y).pre_rotate(turn_deg));
    }
}

/// The outlines of a text whose anchor is at the origin, px.
fn letters(text: &Text) -> Option<Path> {
    let font = font(text.weight);
    let scale = text.size_px / units_per_em(&font);
    let before_anchor = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => 0.5,
        Anchor::End => 1.0,
    };
    let x = -before_anchor * text_width_px(&text.text, text.size_px, text.weight);
    let mut pen = Pen { path: PathBuilder::new(), x, scale };
    let outlines = font.outline_glyphs();
    for letter in text.text.chars() {
        let glyph = glyph(&font, letter);
        if let Some(outline) = outlines.get(glyph) {
            let (size, location) = own_units();
            // A letter whose outline is damaged is left out.
            let _ = outline.draw(DrawSettings::unhinted(size, location), &mut pen);
        }
        pen.x += scale * advance(&font, glyph);
    }
    pen.path.finish()
}

/// Takes outlines in font units, y up, to the page.
struct Pen {
    path: PathBuilder,
    x: f32,
    scale: f32,
}

impl Pen {
    fn to_page(&self, x: f32, y: f32) -> Point {
        (self.x + self.scale * x, -self.scale * y)
    }
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.to_page(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.to_page(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.to_page(x1, y1), self.to_page(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2)) = (self.to_page(x1, y1), self.to_page(x2, y2));
        let (x, y) = self.to_page(x, y);
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

fn encode(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: PIXELS_PER_M,
        yppu: PIXELS_PER_M,
        unit: png::Unit::Meter,
    }));
    encoder.write_header()?.write_image_data(rgb)?;
    Ok(bytes)
}

fn element(shape: &Shape) -> Result<String, DrawingError> {
    Ok(match shape {
        Shape::Area { corners, colour } => {
            format!("<polygon points=\"{}\" fill=\"{}\"/>\n", listed(corners), hex(*colour))
        }
        Shape::Line { points, colour, thickness_px } => format!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{thickness_px}\"/>\n",
            listed(points),
            hex(*colour)
        ),
        Shape::Cells { left_px, top_px, cell_px, columns, colours } => {
            image_element((*left_px, *top_px), *cell_px, *columns, colours)?
        }
        Shape::Text(text) => text_element(text),
    })
}

/// Cells enlarged to the page's pixels, as not every viewer enlarges without smoothing.
fn image_element(
    corner: (u32, u32),
    cell: u32,
    columns: usize,
    cells: &[Rgb],
) -> Result<String, DrawingError> {
    let width = columns as u32 * cell;
    let height = (cells.len() / columns.max(1)) as u32 * cell;
    let rgb: Vec<u8> = pixel_rows(cells, columns, cell).flatten().flatten().copied().collect();
    let (x, y) = corner;
    Ok(format!(
        "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>\n",
        base64(&encode(width, height, &rgb)?)
    ))
}

/// The outlines, so that every viewer shows the same letters; the text stays as their label.
fn text_element(text: &Text) -> String {
    let (x, y) = text.at;
    let turn = if text.upwards { " rotate(-90)" } else { "" };
    format!(
        "<path transform=\"translate({x} {y}){turn}\" fill=\"{}\" aria-label=\"{}\" d=\"{}\"/>\n",
        hex(text.colour),
        escaped(&text.text),
        letters(text).as_ref().map(path_data).unwrap_or_default()
    )
}

fn path_data(path: &Path) -> String {
    let place = |p: tiny_skia::Point| format!("{:.2} {:.2}", p.x, p.y);
    let mut data = String::new();
    for segment in path.segments() {
        data += &match segment {
            PathSegment::MoveTo(to) => format!("M{}", place(to)),
            PathSegment::LineTo(to) => format!("L{}", place(to)),
            PathSegment::QuadTo(via, to) => format!("Q{} {}", place(via), place(to)),
            PathSegment::CubicTo(one, two, to) => {
                format!("C{} {} {}", place(one), place(two), place(to))
            }
            PathSegment::Close => "Z".into(),
        };
    }
    data
}

fn listed(points: &[Point]) -> String {
    let mut list = String::new();
    for (x, y) in points {
        let _ = write!(list, "{x},{y} ");
    }
    list
}

fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_text_is_wider_and_scales() {
        let width = |text, size| text_width_px(text, size, Weight::Regular);
        assert!(width("dBm", 20.0) > width("dB", 20.0));
        assert!((width("θ = 3°", 40.0) - 2.0 * width("θ = 3°", 20.0)).abs() < 1e-3);
        assert_eq!(width("", 20.0), 0.0);
    }

    #[test]
    fn a_grid_keeps_every_page_apart() {
        let page = |width_px: f32, colour: Rgb| {
            let corners = vec![(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)];
            let area = Shape::Area { corners, colour };
            let cells = Shape::Cells {
                left_px: 2,
                top_px: 3,
                cell_px: 1,
                columns: 1,
                colours: vec![colour],
            };
            Drawing { width_px, height_px: 10.0, shapes: vec![area, cells] }
        };
        let pages = [page(20.0, [1; 3]), page(30.0, [2; 3]), page(40.0, [3; 3])];
        let grid = Drawing::grid(&pages, 2);
        assert_eq!((grid.width_px, grid.height_px), (50.0, 20.0));
        let corner = |shape: &Shape| match shape {
            Shape::Area { corners, .. } => corners[0],
            Shape::Cells { left_px, top_px, .. } => (*left_px as f32, *top_px as f32),
            _ => (f32::NAN, f32::NAN),
        };
        let corners: Vec<Point> = grid.shapes.iter().map(corner).collect();
        assert_eq!(
            corners,
            [(0.0, 0.0), (2.0, 3.0), (20.0, 0.0), (22.0, 3.0), (0.0, 10.0), (2.0, 13.0)]
        );
    }

    #[test]
    fn pages_without_area_or_without_end_are_refused() {
        for (width_px, height_px) in [(0.0, 10.0), (10.0, f32::NAN), (1e9, 10.0)] {
            let page = Drawing { width_px, height_px, shapes: Vec::new() };
            assert!(matches!(page.png(), Err(DrawingError::Page { .. })));
        }
    }

    #[test]
    fn shapes_beyond_the_page_are_cut_off() {
        let cells = Shape::Cells {
            left_px: 7,
            top_px: 90,
            cell_px: 50,
            columns: 2,
            colours: vec![[9; 3]; 4],
        };
        let line = Shape::Line {
            points: vec![(-1e7, 5.0), (1e7, f32::NAN)],
            colour: [0; 3],
            thickness_px: 2.0,
        };
        let page = Drawing { width_px: 5.0, height_px: 5.0, shapes: vec![cells, line] };
        assert!(page.png().is_ok());
    }
}
