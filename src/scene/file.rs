//! Scene files: what stands where, of which material, seen by which radar.
//!
//! ```toml
//! [radar]                       # every field of a preset can be overridden
//! preset = "upm-300ghz"
//!
//! [[mesh]]
//! name = "body"
//! file = "builtin:mannequin"    # or a PLY, OBJ or STL file beside the scene
//!
//! [[region]]                    # later regions win where they overlap
//! name = "skin"
//! material = "human-skin"
//! facets = { part = "head" }    # and, or instead: mesh, box, sphere, half_space
//!
//! [[effect]]                    # a physical effect of what stands where
//! name = "foreign-patch"
//! level_db = 3.0                # parameters that are not given are absent
//! ```

use std::collections::BTreeMap;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::formats::text::{from_toml, to_toml_as};
use crate::formats::{EffectEntry, FormatError};
use crate::radar::Radar;

/// A scene file as written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Title for figures; the file's name when empty.
    #[serde(default)]
    pub name: String,
    /// Seed of everything random.
    #[serde(default)]
    pub seed: u64,
    /// Seed of what a repeated scan of the same target draws anew, its noise and errors of ranges; `seed` when not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_seed: Option<u64>,
    /// The instrument.
    #[serde(default)]
    pub radar: Radar,
    /// How the spot is sampled.
    #[serde(default)]
    pub spot: SpotEntry,
    /// Second-order paths, radar → A → B → antenna; none, the paper's, without this table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounce: Option<BounceEntry>,
    /// Antennas beside the radar's own that listen to the same scan.
    #[serde(default, deserialize_with = "antennas")]
    pub receiver: Vec<ReceiverEntry>,
    /// How far rays go on through regions that let a part of the wave through.
    #[serde(default, skip_serializing_if = "TransmissionEntry::is_usual")]
    pub transmission: TransmissionEntry,
    /// How detections become an image.
    #[serde(default)]
    pub image: ImageEntry,
    /// What stands in front of the radar.
    #[serde(default)]
    pub mesh: Vec<MeshEntry>,
    /// Which facets are made of what.
    #[serde(default)]
    pub region: Vec<RegionEntry>,
    /// Physical effects of what stands where, each once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<EffectEntry>,
}

/// How the spot is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SpotEntry {
    /// Rays per chirp, 1 to 10 000. 1: paper, equation (8); more average over the spot, (7).
    pub rays: usize,
}

impl Default for SpotEntry {
    fn default() -> Self {
        SpotEntry { rays: 1 }
    }
}

/// Second-order paths.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BounceEntry {
    /// Directions followed from each lit point, 1 to 10 000. 64: assumed.
    pub rays: usize,
    /// Power by way of a surface outside the spot, over one inside, dB, −200 to 0: what side lobes
    /// let through, both senses of the path together. −20: assumed; side lobes are not published.
    /// Receivers see the whole target alike.
    pub outside_spot_db: f64,
    /// Whether the two ways round a pair of surfaces, which are as long as each other, add in phase at the radar: twice the
    /// power of what is not coherent. Off: as in the paper, powers add.
    #[serde(skip_serializing_if = "is_off")]
    pub in_phase: bool,
}

/// What serde leaves out.
fn is_off(on: &bool) -> bool {
    !*on
}

impl Default for BounceEntry {
    fn default() -> Self {
        BounceEntry { rays: 64, outside_spot_db: -20.0, in_phase: false }
    }
}

/// An antenna that listens to the radar's scan from elsewhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReceiverEntry {
    /// Name, part of the names of its files: small letters, digits and hyphens.
    pub name: String,
    /// Where it stands in the global frame, m.
    pub position_m: [f64; 3],
    /// Equivalent area A_eq, m²; when not given that of the radar, whose antenna it then is, focused on the
    /// same spot.
    pub aperture_m2: Option<f64>,
}

/// How far rays go on through sheets, the regions that let a part of the wave through.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TransmissionEntry {
    /// Largest number of sheets that a ray passes, 1 to 16. 4: assumed, two garments in front of a body and two behind.
    pub sheets: usize,
}

impl Default for TransmissionEntry {
    fn default() -> Self {
        TransmissionEntry { sheets: 4 }
    }
}

impl TransmissionEntry {
    fn is_usual(&self) -> bool {
        *self == TransmissionEntry::default()
    }
}

/// How detections become an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageEntry {
    /// Side of a pixel, m; a quarter of the spot's diameter when not given.
    pub pixel_m: Option<f64>,
}

/// One mesh and where it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshEntry {
    /// Name that regions refer to.
    pub name: String,
    /// Path of a PLY, OBJ or STL file, relative to the scene's folder, or `builtin:NAME`.
    pub file: String,
    /// Factor from the file's unit to metres; 0.001 for a file in millimetres.
    #[serde(default = "one")]
    pub scale: f64,
    /// Stretches the mesh along its own axes until its bounding box has this size, m. The
    /// built-in cuboid, plate and sphere are of unit size without it.
    pub size_m: Option<[f64; 3]>,
    /// Turns about the fixed axes x, then y, then z, degrees.
    #[serde(default)]
    pub rotation_deg: [f64; 3],
    /// Shift after the turns, m.
    #[serde(default)]
    pub translation_m: [f64; 3],
    /// Moves the surface outwards by this distance along its normals, m, once it is placed: cloth over a body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset_m: Option<f64>,
    /// Keeps only the facets whose centroid then lies in this box of the global frame.
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    pub within_box: Option<BoxEntry>,
}

/// A named set of facets and its material. All given selectors must hold; none given selects all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionEntry {
    /// Name, as clouds and reports show it.
    pub name: String,
    /// Material, `NAME` or `NAME@REVISION`.
    pub material: String,
    /// The region is a sheet of its material, of this thickness, m, and lets a part of the wave through.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness_m: Option<f64>,
    /// Whether the wave passes through: the material's law then is a stack of layers with air behind it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub transmits: bool,
    /// Direction of the grain in the global frame, of any length; upwards when not given. It is
    /// projected onto each facet; `m` of an anisotropic model is along it, azimuth counts from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grain: Option<[f64; 3]>,
    /// Share of its diffuse return that comes back across the polarisation that was sent, 0 to 0.5; 0.5
    /// is an echo without any polarisation left. The law is the co-polar return: this adds to it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub depolarised_share: f64,
    /// Only facets of this mesh.
    pub mesh: Option<String>,
    /// Only facets labelled so by the file: `{ part = "head" }`, `{ usemtl = "skin" }`,
    /// `{ region = 2 }` for a PLY face property.
    #[serde(default)]
    pub facets: BTreeMap<String, LabelValue>,
    /// Only facets whose centroid lies in this box of the global frame.
    #[serde(rename = "box")]
    pub within_box: Option<BoxEntry>,
    /// Only facets whose centroid lies in this ball.
    pub sphere: Option<SphereEntry>,
    /// Only facets whose centroid lies on the side of a plane that its normal points to.
    pub half_space: Option<HalfSpaceEntry>,
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// The value of a facet label.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a name in quotes or a whole number")]
pub enum LabelValue {
    /// A name.
    Text(String),
    /// A number, for integer properties of PLY faces.
    Number(i64),
}

/// An axis-aligned box in the global frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxEntry {
    /// Corner with the smallest coordinates, m.
    pub min_m: [f64; 3],
    /// Corner with the largest coordinates, m.
    pub max_m: [f64; 3],
}

/// A ball in the global frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SphereEntry {
    /// Centre, m.
    pub centre_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
}

/// A half space in the global frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HalfSpaceEntry {
    /// A point of the plane, m.
    pub point_m: [f64; 3],
    /// Normal of the plane, of any length.
    pub normal: [f64; 3],
}

/// A list of tables; `[receiver]` is a likely slip for either of two things.
fn antennas<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<ReceiverEntry>, D::Error> {
    struct Antennas;
    impl<'de> Visitor<'de> for Antennas {
        type Value = Vec<ReceiverEntry>;

        fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
            f.write_str(
                "[[receiver]] for an antenna elsewhere, or [radar.receiver] for the range receiver",
            )
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
            let mut entries = Vec::new();
            while let Some(entry) = list.next_element()? {
                entries.push(entry);
            }
            Ok(entries)
        }
    }
    deserializer.deserialize_seq(Antennas)
}

fn one() -> f64 {
    1.0
}

impl SceneFile {
    /// Reads a scene file's text. Values are checked when the scene is loaded.
    pub fn parse(text: &str) -> Result<SceneFile, FormatError> {
        from_toml(text)
    }

    /// Writes it with what `given`, the text it was read from, says, and with its name and effects:
    /// defaults stay unwritten.
    ///
    /// # Errors
    /// When `given` is no TOML.
    pub fn write(&self, given: &str) -> Result<String, FormatError> {
        // A level that a diagnosis found, too, where none was given.
        let is_usual = self.radar.system_loss_db == Radar::default().system_loss_db;
        let always = ["name", "effect", "system_loss_db"];
        to_toml_as(self, given, if is_usual { &always[..2] } else { &always })
    }
}

impl std::fmt::Display for LabelValue {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            LabelValue::Text(text) => f.write_str(text),
            LabelValue::Number(number) => number.fmt(f),
        }
    }
}
