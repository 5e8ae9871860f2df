//! One channel of a raster as a figure for a paper: pixels, axes, colour bar, title.

use super::axes::{Axes, Axis};
use super::colour_bar::{Bar, Colours, Scale, nothing};
use super::drawing::{Drawing, Shape};
use super::error::FigureError;
use super::style::{GAP_PX, MARGIN_PX, TITLE_MIN_WIDTH_PX};
use crate::geometry::raster::Raster;

/// The longest sides of the data area in which pixels are still drawn larger than 1 px.
const DATA_WIDTH_PX: usize = 1200;
const DATA_HEIGHT_PX: usize = 1000;

/// A picture of one channel of a raster.
///
/// Every pixel of the raster is a square of whole image pixels, coloured by its scale. NaN is
/// grey, which a note explains; a value beyond the range has the colour of the range's end,
/// and the colour bar ends in a triangle there.
#[derive(Clone, Copy, Debug)]
pub struct Figure<'a> {
    /// Where the channel is.
    pub raster: &'a Raster,
    /// The channel's name.
    pub channel: &'a str,
    /// First line, bold; may be empty.
    pub title: &'a str,
    /// Second line, quiet; may be empty.
    pub subtitle: &'a str,
    /// Quantity and unit of the colours, such as `received power, dBm`.
    pub colour_label: &'a str,
    /// Values of the first and the last colour, in the channel's unit; of the data if `None`.
    pub range: Option<(f64, f64)>,
    /// Which colours stand for which values.
    pub scale: Scale,
    /// What NaN means, such as `no detection`.
    pub gaps: &'a str,
    /// Quantity and unit along x, such as `x, m`.
    pub x_label: &'a str,
    /// Quantity and unit along y, such as `y, m`.
    pub y_label: &'a str,
}

impl Figure<'_> {
    /// The figure as the bytes of a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, FigureError> {
        Ok(self.drawing()?.png()?)
    }

    /// The figure as the text of an SVG file, with the raster's pixels embedded as an image.
    pub fn svg(&self) -> Result<String, FigureError> {
        Ok(self.drawing()?.svg()?)
    }

    /// The pixels alone as the bytes of a PNG file, one of the picture for each of the raster.
    ///
    /// # Errors
    /// As [`Figure::drawing`].
    pub fn pixels(&self) -> Result<Vec<u8>, FigureError> {
        let values = self.values()?;
        let colours = Colours::over(values, self.range, self.scale)?;
        let cells = self.cells([0, 0], 1, values, colours.as_ref());
        let [width_px, height_px] = [self.raster.width, self.raster.height].map(|n| n as f32);
        Ok(Drawing { width_px, height_px, shapes: vec![cells] }.png()?)
    }

    /// The figure as a page.
    ///
    /// # Errors
    /// When the raster has no such channel, or its numbers or the range make no picture.
    pub fn drawing(&self) -> Result<Drawing, FigureError> {
        let values = self.values()?;
        let colours = Colours::over(values, self.range, self.scale)?;
        let data = [self.data_width_px(), self.data_height_px()];
        let gaps = (nothing(self.scale), self.gaps);
        let bar = Bar::new(self.colour_label, gaps, colours.as_ref(), values, data[1]);
        let content = (data[0] + 2.5 * GAP_PX + bar.width()).max(TITLE_MIN_WIDTH_PX);
        let axes = Axes::new(self.axes(), data, [self.title, self.subtitle], content);

        let corner = [axes.left as u32, axes.top as u32];
        let cells = self.cells(corner, self.cell_px() as u32, values, colours.as_ref());
        let mut shapes = vec![cells];
        shapes.extend(axes.shapes());
        shapes.extend(bar.shapes(axes.left + axes.data_width + 2.5 * GAP_PX, axes.top));
        let bottom = axes.height_with_labels().max(bar.height);
        Ok(Drawing {
            width_px: (axes.left + content + MARGIN_PX).ceil(),
            height_px: (axes.top + bottom + MARGIN_PX / 2.0).ceil(),
            shapes,
        })
    }

    fn axes(&self) -> [Axis<'_>; 2] {
        let Raster { x_min_m, y_min_m, pixel_m, width, height, .. } = *self.raster;
        let (x_max_m, y_max_m) =
            (x_min_m + pixel_m * width as f64, y_min_m + pixel_m * height as f64);
        [
            Axis { label: self.x_label, low: x_min_m, high: x_max_m },
            Axis { label: self.y_label, low: y_min_m, high: y_max_m },
        ]
    }

    fn values(&self) -> Result<&[f32], FigureError> {
        let raster = self.raster;
        let values = raster.channel(self.channel).ok_or_else(|| FigureError::NoChannel {
            channel: self.channel.into(),
            available: raster
                .channels
                .iter()
                .map(|c| c.name.as_str())
                .collect::<Vec<_>>()
                .join(", "),
        })?;
        let filled =
            !values.is_empty() && raster.width.checked_mul(raster.height) == Some(values.len());
        let placed = raster.x_min_m.is_finite() && raster.y_min_m.is_finite();
        if filled && placed && raster.pixel_m > 0.0 && raster.pixel_m.is_finite() {
            return Ok(values);
        }
        Err(FigureError::Grid {
            values: values.len(),
            width: raster.width,
            height: raster.height,
            pixel_m: raster.pixel_m,
        })
    }

    /// Side of a raster pixel, px.
    fn cell_px(&self) -> usize {
        (DATA_WIDTH_PX / self.raster.width).min(DATA_HEIGHT_PX / self.raster.height).max(1)
    }

    fn data_width_px(&self) -> f32 {
        (self.raster.width * self.cell_px()) as f32
    }

    fn data_height_px(&self) -> f32 {
        (self.raster.height * self.cell_px()) as f32
    }

    /// The pixels from a corner of the page on, of this size, px.
    fn cells(
        &self,
        [left_px, top_px]: [u32; 2],
        cell_px: u32,
        values: &[f32],
        colours: Option<&Colours>,
    ) -> Shape {
        Shape::Cells {
            left_px,
            top_px,
            cell_px,
            columns: self.raster.width,
            colours: values
                .iter()
                .map(|&v| colours.map_or_else(|| nothing(self.scale), |c| c.of(v)))
                .collect(),
        }
    }
}

/// Figures from left to right on one page, as the bytes of a PNG file.
pub fn beside(figures: &[Figure]) -> Result<Vec<u8>, FigureError> {
    let mut page = Drawing::default();
    for figure in figures {
        page = page.beside(figure.drawing()?);
    }
    Ok(page.png()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::figure::colour_bar::NOTHING;
    use crate::formats::figure::drawing::Rgb;
    use crate::formats::figure::style::INK;
    use crate::geometry::raster::Channel;

    const WIDTH: usize = 125;
    const HEIGHT: usize = 225;

    fn raster(value: impl Fn(f64, f64) -> f64) -> Raster {
        let mut raster = Raster {
            width: WIDTH,
            height: HEIGHT,
            x_min_m: -0.25,
            y_min_m: -0.45,
            pixel_m: 0.004,
            channels: Vec::new(),
        };
        let at = |i: usize| value(raster.x_m(i % WIDTH), raster.y_m(i / WIDTH)) as f32;
        let values = (0..WIDTH * HEIGHT).map(at).collect();
        raster.channels.push(Channel { name: "power_dbm".into(), values });
        raster
    }

    /// A smooth blob of −40 to −70 dBm with nothing around it.
    fn blob(x_m: f64, y_m: f64) -> f64 {
        let away = (x_m / 0.15).powi(2) + (y_m / 0.3).powi(2);
        if away < 1.0 { -40.0 - 30.0 * away } else { f64::NAN }
    }

    fn figure(raster: &Raster) -> Figure<'_> {
        Figure {
            raster,
            channel: "power_dbm",
            title: "Plate",
            subtitle: "300 GHz, θ = 20°",
            colour_label: "received power, dBm",
            range: Some((-70.0, -40.0)),
            scale: Scale::Sequential,
            gaps: "no detection",
            x_label: "x, m",
            y_label: "y, m",
        }
    }

    struct Picture {
        width: usize,
        height: usize,
        rgb: Vec<u8>,
    }

    impl Picture {
        fn decode(bytes: &[u8]) -> Picture {
            let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
            let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut rgb).unwrap();
            Picture { width: info.width as usize, height: info.height as usize, rgb }
        }

        fn at(&self, x: usize, y: usize) -> Rgb {
            let start = 3 * (y * self.width + x);
            [self.rgb[start], self.rgb[start + 1], self.rgb[start + 2]]
        }

        /// The cell of a raster, after checking that all its pixels are alike.
        fn cell(&self, page: &Axes, column: usize, row: usize) -> Rgb {
            let (left, top) = (page.left as usize + 4 * column, page.top as usize + 4 * row);
            let colour = self.at(left, top);
            assert!((0..16).all(|i| self.at(left + i % 4, top + i / 4) == colour));
            colour
        }
    }

    fn page<'a>(figure: &'a Figure) -> Axes<'a> {
        let data = [figure.data_width_px(), figure.data_height_px()];
        Axes::new(figure.axes(), data, [figure.title, figure.subtitle], 600.0)
    }

    #[test]
    fn cells_have_the_colour_of_their_value() {
        let raster = raster(blob);
        let figure = figure(&raster);
        let (page, picture) = (page(&figure), Picture::decode(&figure.png().unwrap()));
        for (column, row) in [(62, 112), (50, 112), (70, 60), (40, 150)] {
            let share = (blob(raster.x_m(column), raster.y_m(row)) + 70.0) / 30.0;
            let wanted = colorous::VIRIDIS.eval_continuous(share).into_array();
            let cell = picture.cell(&page, column, row);
            let close = |channel: usize| cell[channel].abs_diff(wanted[channel]) <= 3;
            assert!((0..3).all(close), "{cell:?} for {wanted:?} at {column}, {row}");
        }
        for (column, row) in [(0, 0), (124, 224), (5, 112)] {
            assert_eq!(picture.cell(&page, column, row), NOTHING);
        }
    }

    #[test]
    fn the_page_is_upright_and_its_data_has_square_pixels() {
        let raster = raster(blob);
        let figure = figure(&raster);
        let (page, picture) = (page(&figure), Picture::decode(&figure.png().unwrap()));
        assert_eq!((page.data_width, page.data_height), (500.0, 900.0));
        assert!((1000..1200).contains(&picture.height) && (700..900).contains(&picture.width));
        let ink_left_of_the_data = picture.at(page.left as usize - 1, page.top as usize + 450);
        assert_eq!(ink_left_of_the_data, INK);
    }

    #[test]
    fn the_same_raster_gives_the_same_bytes() {
        let raster = raster(blob);
        assert_eq!(figure(&raster).png().unwrap(), figure(&raster).png().unwrap());
        assert_eq!(figure(&raster).svg().unwrap(), figure(&raster).svg().unwrap());
    }

    #[test]
    fn nothing_and_a_constant_can_be_drawn() {
        let colour_in_the_middle = |value: f64, range| {
            let raster = raster(|_, _| value);
            let figure = Figure { range, ..figure(&raster) };
            Picture::decode(&figure.png().unwrap()).cell(&page(&figure), 62, 112)
        };
        assert_eq!(colour_in_the_middle(f64::NAN, None), NOTHING);
        assert_eq!(colour_in_the_middle(f64::NAN, Some((-70.0, -40.0))), NOTHING);
        let middle = colorous::VIRIDIS.eval_rational(128, 256).into_array();
        assert_eq!(colour_in_the_middle(-40.0, None), middle);
        assert_eq!(colour_in_the_middle(0.0, None), middle);
        let lowest = colorous::VIRIDIS.eval_rational(0, 256).into_array();
        assert_eq!(colour_in_the_middle(f64::NEG_INFINITY, Some((-70.0, -40.0))), lowest);
    }

    #[test]
    fn any_shape_of_raster_fits_its_page() {
        for (width, height) in [(1, 1), (1, 225), (400, 3), (300, 1100)] {
            let values = (0..width * height).map(|i| i as f32).collect();
            let channels = vec![Channel { name: "power_dbm".into(), values }];
            let raster = Raster { width, height, channels, ..raster(blob) };
            let figure = Figure { range: None, ..figure(&raster) };
            let (page, picture) = (page(&figure), Picture::decode(&figure.png().unwrap()));
            assert!(page.left + page.data_width < picture.width as f32, "{width} × {height}");
            assert!(page.top + page.data_height < picture.height as f32, "{width} × {height}");
        }
    }

    #[test]
    fn figures_that_cannot_be_drawn_say_why() {
        let good = raster(blob);
        let error = Figure { channel: "range_m", ..figure(&good) }.png().unwrap_err();
        assert!(error.to_string().contains("power_dbm"), "{error}");
        for range in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            let error = Figure { range: Some(range), ..figure(&good) }.png().unwrap_err();
            assert!(matches!(error, FigureError::Range { .. }), "{range:?}");
        }
        let empty = Raster { width: 0, height: 0, ..raster(blob) };
        let flat = Raster { pixel_m: 0.0, ..raster(blob) };
        let adrift = Raster { x_min_m: f64::NAN, ..raster(blob) };
        for bad in [empty, flat, adrift] {
            assert!(matches!(figure(&bad).png(), Err(FigureError::Grid { .. })));
        }
    }
}
