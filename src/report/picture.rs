//! A picture of a report: panels for the page, and files for a paper.

use serde::Serialize;

use crate::error::Error;
use crate::formats::figure::drawing::Drawing;
use crate::formats::figure::{FigureError, Ink, Series, Style};

/// One picture: a file for a paper, and panels that a page can put below each other.
pub struct Picture {
    /// Name of its files without their ending.
    pub file: &'static str,
    /// What it is.
    pub title: &'static str,
    /// What it shows, for readers who do not see it, and below it for those who do.
    pub caption: String,
    /// Its parts.
    pub panels: Vec<Drawing>,
    /// Panels in a row of the file.
    pub columns: usize,
}

/// A picture as a page embeds it.
#[derive(Serialize)]
pub(super) struct Figure<'a> {
    title: &'static str,
    caption: &'a str,
    /// SVG of each panel.
    panels: Vec<String>,
}

impl Picture {
    /// Its files: name and bytes of the SVG and of the PNG.
    ///
    /// # Errors
    /// A page that is too large to be drawn.
    pub fn files(&self) -> Result<[(String, Vec<u8>); 2], Error> {
        let page = Drawing::grid(&self.panels, self.columns);
        let svg = page.svg().map_err(FigureError::from)?;
        let png = page.png().map_err(FigureError::from)?;
        Ok([(format!("{}.svg", self.file), svg.into_bytes()), (format!("{}.png", self.file), png)])
    }

    /// The picture for a page.
    pub(super) fn figure(&self) -> Result<Figure<'_>, Error> {
        let mut panels = Vec::new();
        for panel in &self.panels {
            let svg = panel.svg().map_err(FigureError::from)?;
            // Inside a page the name space is understood.
            panels.push(svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1));
        }
        Ok(Figure { title: self.title, caption: &self.caption, panels })
    }
}

/// y over x as a thin line, from so many points that the ends of the axes can cut it.
pub(super) fn guide(name: &str, [from, to]: [f64; 2], y: impl Fn(f64) -> f64) -> Series {
    const STEPS: u32 = 400;
    let mut points = Vec::new();
    for step in 0..=STEPS {
        let x = from + (to - from) * f64::from(step) / f64::from(STEPS);
        points.push((x, y(x)));
    }
    Series { name: name.to_owned(), style: Style::Guide, ink: Ink::Own(0), points }
}
