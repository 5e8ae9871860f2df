//! The data of `view.html`, as its script reads them.

use glam::{DMat4, DVec3};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::labels::label;
use crate::error::Error;
use crate::formats::base64::base64;
use crate::formats::figure::LESS_AND_MORE_HUE_DEG;
use crate::formats::words::{counted, grouped};
use crate::frames::{Global, Pose};
use crate::geometry::Mesh;
use crate::report::templates;

/// A cloud in three dimensions, with what stands around it.
#[derive(Serialize)]
pub(in crate::report) struct ViewPage<'a> {
    #[serde(skip)]
    pub title: &'a str,
    /// What the cloud is, such as `Rendered cloud`.
    #[serde(skip)]
    pub kind: &'static str,
    /// Sentences on what the page leaves out.
    #[serde(skip)]
    pub notes: Vec<String>,
    pub points: Points,
    pub mesh: Option<Surface>,
    pub radar: Instrument,
    pub image: Option<PlaneImage>,
    pub shapes: Vec<Outlines>,
    pub curve: Curve,
    /// Of the page of a catalogue.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub balls: Option<Balls>,
}

/// What the page of a catalogue has in addition.
#[derive(Serialize)]
pub(in crate::report) struct Balls {
    /// For every ball its name, the place of the name, m, and the room for it, m.
    pub labels: Vec<(String, [f64; 3], f64)>,
    /// What a person should know of the materials.
    #[serde(skip)]
    pub notices: Vec<String>,
}

/// The points of a cloud.
#[derive(Default, Serialize)]
pub(in crate::report) struct Points {
    pub count: usize,
    /// In the global frame, three numbers a point.
    pub position_m: Numbers,
    pub columns: Vec<Values>,
}

/// One value of every point.
#[derive(Serialize)]
pub(in crate::report) struct Values {
    name: String,
    label: String,
    unit: &'static str,
    values: Numbers,
    /// Where the values are numbers of names: the names.
    #[serde(skip_serializing_if = "Option::is_none")]
    names: Option<Vec<String>>,
}

/// The target.
#[derive(Serialize)]
pub(in crate::report) struct Surface {
    vertices_m: Numbers,
    triangles: Numbers,
}

/// Where the radar stands and looks.
#[derive(Serialize)]
pub(in crate::report) struct Instrument {
    pub origin_m: [f64; 3],
    pub target_m: [f64; 3],
    /// Where the beam meets the target plane, from chirp to chirp.
    pub path_m: Numbers,
    /// Outline of the spot there.
    pub spot_m: Numbers,
}

/// An image of the target plane, and where it lies.
#[derive(Serialize)]
pub(in crate::report) struct PlaneImage {
    /// What its colours are.
    pub label: String,
    /// Bytes of a PNG file, a pixel each.
    pub png: String,
    pub rows: usize,
    pub columns: usize,
    /// Centre of the first pixel, m.
    pub from_m: [f64; 2],
    pub step_m: [f64; 2],
}

/// Where an effect that was found acts.
#[derive(Serialize)]
pub(in crate::report) struct Outlines {
    label: String,
    /// The places of all lines, one line after the other.
    lines_m: Numbers,
    /// Number of places up to the end of each line.
    ends: Vec<usize>,
    /// A motion of the target, of which the edges of the mesh are drawn where it takes them: columns of a matrix of 4 × 4.
    #[serde(skip_serializing_if = "Option::is_none")]
    motion: Option<[f64; 16]>,
}

/// Two columns that are drawn as a curve.
#[derive(Serialize)]
pub(in crate::report) struct Curve {
    pub x: &'static str,
    pub y: &'static str,
}

/// Numbers as text: little-endian bytes in base64.
#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::report) enum Numbers {
    F32(String),
    U16(String),
    U32(String),
}

impl Default for Numbers {
    fn default() -> Numbers {
        Numbers::floats(std::iter::empty())
    }
}

impl Numbers {
    pub fn floats(values: impl Iterator<Item = f64>) -> Numbers {
        Numbers::F32(base64(
            &values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>(),
        ))
    }

    pub fn places(places: impl Iterator<Item = DVec3>) -> Numbers {
        Numbers::floats(places.flat_map(|place| place.to_array()))
    }
}

impl Values {
    /// Numbers under the name of their column.
    pub fn numbers(name: &str, values: impl Iterator<Item = f64>) -> Values {
        let (label, unit) = label(name);
        let values = Numbers::floats(values);
        Values { name: name.to_owned(), label: label.to_owned(), unit, values, names: None }
    }

    /// Numbers of names. What has none gets a name of its own, `other`, which is the last where it is needed.
    pub fn named(
        name: &str,
        names: &[&str],
        other: &str,
        numbers: impl Iterator<Item = Option<usize>>,
    ) -> Values {
        let last = names.len().min(usize::from(u16::MAX));
        let numbers: Vec<u16> =
            numbers.map(|number| number.map_or(last, |known| known.min(last)) as u16).collect();
        let other = numbers.contains(&(last as u16)).then_some(&other);
        let bytes: Vec<u8> = numbers.into_iter().flat_map(u16::to_le_bytes).collect();
        let names = names.iter().chain(other).map(|name| (*name).to_owned()).collect();
        let (label, unit) = label(name);
        let values = Numbers::U16(base64(&bytes));
        Values { name: name.to_owned(), label: label.to_owned(), unit, values, names: Some(names) }
    }
}

impl Values {
    /// Places of detections among those of their chirps, from 1, each as an entry of its own.
    pub fn ranks(ranks: impl Iterator<Item = Option<u32>> + Clone) -> Values {
        let last = ranks.clone().flatten().max().unwrap_or_default();
        let names: Vec<String> = (1..=last).map(|rank| rank.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let numbers = ranks.map(|rank| Some(rank?.checked_sub(1)? as usize));
        Values::named("rank", &names, "not known", numbers)
    }
}

impl Outlines {
    /// A line through some places, with a gap at each that is missing; none where no two follow each other.
    pub fn new(label: String, places: &[Option<DVec3>]) -> Option<Outlines> {
        let (mut line, mut ends) = (Vec::new(), Vec::new());
        for piece in places.split(Option::is_none).filter(|piece| piece.len() > 1) {
            line.extend(piece.iter().flatten());
            ends.push(line.len());
        }
        (!ends.is_empty()).then(|| Outlines {
            label,
            lines_m: Numbers::places(line.into_iter()),
            ends,
            motion: None,
        })
    }

    /// The mesh where a motion takes it.
    pub fn moved(label: String, motion: Pose<Global, Global>) -> Outlines {
        let motion =
            DMat4::from_mat3_translation(motion.rotation(), motion.translation_m()).to_cols_array();
        let (lines_m, ends) = (Numbers::places(std::iter::empty()), Vec::new());
        Outlines { label, lines_m, ends, motion: Some(motion) }
    }
}

/// Facets that a page can draw. With more it would be slow to load.
const MOST_FACETS: usize = 300_000;

impl Surface {
    /// A mesh; none of one that would make the page slow to load.
    pub fn of(mesh: &Mesh) -> Option<Surface> {
        if mesh.facets.is_empty() || mesh.facets.len() > MOST_FACETS {
            return None;
        }
        let corners = mesh.facets.iter().flatten().flat_map(|corner| corner.to_le_bytes());
        let triangles = Numbers::U32(base64(&corners.collect::<Vec<u8>>()));
        Some(Surface { vertices_m: Numbers::places(mesh.vertices.iter().copied()), triangles })
    }

    /// A sentence on a mesh of which there is no surface for its size.
    pub fn left_out(mesh: &Mesh) -> Option<String> {
        (mesh.facets.len() > MOST_FACETS).then(|| {
            format!(
                "The mesh is not drawn. It has {}; this page draws at most {}.",
                counted(mesh.facets.len(), "facet"),
                grouped(MOST_FACETS)
            )
        })
    }
}

impl ViewPage<'_> {
    /// The page as bytes.
    ///
    /// # Errors
    /// A number that JSON does not have.
    pub fn bytes(&self) -> Result<Vec<u8>, Error> {
        #[derive(Serialize)]
        struct Words<'a> {
            title: &'a str,
            about: String,
            notes: &'a [String],
            /// Of the page of a catalogue.
            notices: Option<&'a [String]>,
            /// Of less and of more than predicted.
            hues: [f64; 2],
        }
        #[derive(Serialize)]
        struct Context<'a> {
            page: Words<'a>,
            data: String,
        }
        let points = counted(self.points.count, "point");
        let version = env!("CARGO_PKG_VERSION");
        let about = format!("{} of {points}, made by matdb {version}", self.kind);
        let hues = LESS_AND_MORE_HUE_DEG;
        let notices = self.balls.as_ref().map(|balls| balls.notices.as_slice());
        let page = Words { title: self.title, about, notes: &self.notes, notices, hues };
        let page =
            templates::text("view.html", &Context { page, data: serde_json::to_string(self)? })?;
        Ok(with_policy(&page).into_bytes())
    }
}

/// A page that runs its own script and no other, and asks for nothing.
fn with_policy(page: &str) -> String {
    const START: &str = "<meta charset=\"utf-8\">\n";
    let script = page.split_once("<script type=\"module\">");
    let script = script.and_then(|(_, rest)| Some(rest.split_once("</script>")?.0));
    let hash = base64(&Sha256::digest(script.unwrap_or_default()));
    let policy = format!(
        "{START}<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'sha256-{hash}'; \
         style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\">\n"
    );
    page.replacen(START, &policy, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_is_small() {
        // Every diagnosis holds a copy of it.
        const MOST_BYTES: usize = 60_000;
        let bytes = include_str!("../templates/view.html").len();
        assert!(bytes < MOST_BYTES, "view.html has {bytes} bytes");
    }

    #[test]
    fn a_page_says_which_mesh_it_leaves_out() {
        let facets = vec![[0, 1, 2]; MOST_FACETS + 1];
        let large =
            Mesh { vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y], facets, labels: vec![] };
        let small = Mesh { facets: vec![[0, 1, 2]; 2], ..large.clone() };
        assert!(Surface::of(&large).is_none() && Surface::of(&small).is_some());
        assert_eq!(Surface::left_out(&small), None);
        let none = || Numbers::places(std::iter::empty());
        let radar = Instrument {
            origin_m: [0.0, 1.1, 8.0],
            target_m: [0.0, 1.1, 0.0],
            path_m: none(),
            spot_m: none(),
        };
        let page = ViewPage {
            title: "Large <mesh>",
            kind: "Rendered cloud",
            notes: Surface::left_out(&large).into_iter().collect(),
            points: Points { count: 0, position_m: none(), columns: vec![] },
            mesh: Surface::of(&large),
            radar,
            image: None,
            shapes: vec![],
            curve: Curve { x: "incidence_deg", y: "power_dbm" },
            balls: None,
        };
        let page = String::from_utf8(page.bytes().unwrap()).unwrap();
        for words in ["Large &lt;mesh&gt;", "Rendered cloud of 0 points", "It has 300 001 facets"] {
            assert!(page.contains(words), "{words}");
        }
    }

    #[test]
    fn a_line_has_a_gap_where_places_are_missing() {
        let [a, b] = [Some(DVec3::X), Some(DVec3::Y)];
        let line = |places: &[_]| Outlines::new("border".to_owned(), places);
        let ends = |places: &[_]| line(places).map(|line| line.ends);
        assert_eq!(ends(&[a, b, b]), Some(vec![3]));
        // A place alone is no line.
        assert_eq!(ends(&[None, a, b, None, None, a, None, b, a, b]), Some(vec![2, 5]));
        assert_eq!(ends(&[a, None, b]), None);
    }
}
