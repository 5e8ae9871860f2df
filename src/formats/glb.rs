//! glTF 2.0 in one binary file (`.glb`): points and surfaces with colours, for programs that show scenes in three dimensions.
//!
//! The format (Khronos, glTF 2.0, section 4.4): a header of 12 bytes, a chunk of JSON, and a chunk of the numbers that it
//! describes, little-endian. Lengths are metres and y is up, as in the global frame of a scene: no axis changes. Places are
//! 32-bit floats, colours linear light.

use std::collections::HashMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::error::FormatError;
use super::light::light_of_srgb;

/// Red, green and blue, sRGB.
type Rgb = [u8; 3];

/// What a file shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model<'a> {
    /// Its name.
    pub name: &'a str,
    /// The points; a cloud without points is left out.
    pub cloud: Cloud,
    /// Colours of surfaces.
    pub paints: Vec<Paint<'a>>,
    /// The surfaces; one without facets is left out.
    pub surfaces: Vec<Surface<'a>>,
    /// What the file says of itself, such as its units: an object.
    pub extras: Value,
}

/// Points. Everything about them is finite, and has one entry for each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// Places, m.
    pub places_m: Vec<DVec3>,
    /// Colours.
    pub colours: Vec<Rgb>,
    /// Values under names with their units, such as `power_dbm`; a file has them in capitals after `_`.
    pub values: Vec<(&'static str, Vec<f32>)>,
    /// What the file says of the points, such as the meaning of their colours: an object.
    pub extras: Value,
}

/// The colour of surfaces, under a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its colour.
    pub colour: Rgb,
    /// From 0 for what cannot be seen to 1 for what hides everything behind it.
    pub opacity: f32,
}

/// Facets of one colour, which are seen from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface<'a> {
    /// Its name.
    pub name: &'a str,
    /// Number of its paint.
    pub paint: usize,
    /// Vertices, m; those of no facet are left out.
    pub vertices_m: &'a [DVec3],
    /// Three numbers of vertices each.
    pub facets: Vec<[u32; 3]>,
}

// Numbers by which glTF names types of numbers, uses of numbers, and ways to draw.
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const OF_VERTICES: u32 = 34962;
const OF_INDICES: u32 = 34963;
const POINTS: u32 = 0;
const TRIANGLES: u32 = 4;

/// Bytes of the header, and of what begins a chunk.
const HEADER: usize = 12;
const CHUNK: usize = 8;

/// The bytes of a file.
///
/// # Errors
/// More than 4 GiB, which the format cannot hold.
pub fn write(model: &Model) -> Result<Vec<u8>, FormatError> {
    let mut numbers = Numbers::default();
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    let cloud = (!model.cloud.places_m.is_empty()).then(|| ("cloud", numbers.cloud(&model.cloud)));
    let surfaces = model.surfaces.iter().filter(|surface| !surface.facets.is_empty());
    let surfaces = surfaces.map(|surface| (surface.name, numbers.surface(surface)));
    for (name, primitive) in cloud.into_iter().chain(surfaces.collect::<Vec<_>>()) {
        nodes.push(json!({ "name": name, "mesh": meshes.len() }));
        meshes.push(json!({ "name": name, "primitives": [primitive] }));
    }
    let mut scene = json!({ "name": model.name, "extras": model.extras });
    let mut root = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("matdb ", env!("CARGO_PKG_VERSION")),
        },
        "scene": 0,
    });
    // The format has no empty lists.
    let Numbers { bytes, views, accessors } = numbers;
    if !meshes.is_empty() {
        scene["nodes"] = (0..nodes.len()).collect();
        root["nodes"] = nodes.into();
        root["meshes"] = meshes.into();
        root["accessors"] = accessors.into();
        root["bufferViews"] = views.into();
        root["buffers"] = json!([{ "byteLength": bytes.len() }]);
    }
    if !model.paints.is_empty() {
        root["materials"] = model.paints.iter().map(material).collect();
    }
    root["scenes"] = json!([scene]);
    file(root.to_string().into_bytes(), bytes)
}

fn file(mut json: Vec<u8>, numbers: Vec<u8>) -> Result<Vec<u8>, FormatError> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut chunks = vec![(b"JSON", json)];
    if !numbers.is_empty() {
        chunks.push((b"BIN\0", numbers));
    }
    let length = HEADER + chunks.iter().map(|(_, bytes)| CHUNK + bytes.len()).sum::<usize>();
    let total = u32::try_from(length).map_err(|_| {
        let problem = format!("it would have {length} bytes, and the format ends at 4 GiB");
        FormatError::at("glTF", problem, "show fewer points or facets")
    })?;
    let mut file = Vec::with_capacity(length);
    file.extend(b"glTF");
    file.extend(2u32.to_le_bytes());
    file.extend(total.to_le_bytes());
    for (kind, bytes) in chunks {
        file.extend((bytes.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(bytes);
    }
    Ok(file)
}

fn material(paint: &Paint) -> Value {
    let [red, green, blue] = paint.colour.map(light_of_srgb);
    let is_clear = paint.opacity < 1.0;
    json!({
        "name": paint.name,
        "doubleSided": true,
        "alphaMode": if is_clear { "BLEND" } else { "OPAQUE" },
        "pbrMetallicRoughness": {
            "baseColorFactor": [red, green, blue, paint.opacity],
            "metallicFactor": 0,
            "roughnessFactor": 1,
        },
    })
}

/// The numbers of a file, and where in them each list is.
#[derive(Default)]
struct Numbers {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Numbers {
    fn cloud(&mut self, cloud: &Cloud) -> Value {
        let parts = cloud.colours.as_flattened().iter();
        let colours = parts.flat_map(|part| light_of_srgb(*part).to_le_bytes()).collect();
        let mut attributes = json!({ "POSITION": self.places(cloud.places_m.iter().copied()) });
        attributes["COLOR_0"] = self.list(colours, OF_VERTICES, FLOAT, "VEC3");
        for (name, values) in &cloud.values {
            let values = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            let list = self.list(values, OF_VERTICES, FLOAT, "SCALAR");
            attributes[format!("_{}", name.to_uppercase())] = list;
        }
        json!({ "mode": POINTS, "attributes": attributes, "extras": cloud.extras })
    }

    fn surface(&mut self, surface: &Surface) -> Value {
        let mut number_of_vertex = HashMap::new();
        let mut vertices_m = Vec::new();
        let mut corners = Vec::new();
        for &vertex in surface.facets.as_flattened() {
            let number: u32 = *number_of_vertex.entry(vertex).or_insert_with(|| {
                vertices_m.push(surface.vertices_m[vertex as usize]);
                (vertices_m.len() - 1) as u32
            });
            corners.extend(number.to_le_bytes());
        }
        let places = self.places(vertices_m.into_iter());
        let indices = self.list(corners, OF_INDICES, UNSIGNED_INT, "SCALAR");
        json!({
            "mode": TRIANGLES,
            "attributes": { "POSITION": places },
            "indices": indices,
            "material": surface.paint,
        })
    }

    /// A list of places, with the box around them, which the format wants.
    fn places(&mut self, places_m: impl Iterator<Item = DVec3>) -> Value {
        let places: Vec<[f32; 3]> = places_m.map(|place| place.as_vec3().to_array()).collect();
        let outer = |outer: fn(f32, f32) -> f32| {
            places.iter().copied().reduce(|a, b| [0, 1, 2].map(|axis| outer(a[axis], b[axis])))
        };
        let [min, max] = [outer(f32::min), outer(f32::max)];
        let bytes = places.iter().flatten().flat_map(|part| part.to_le_bytes()).collect();
        let list = self.list(bytes, OF_VERTICES, FLOAT, "VEC3");
        if let Some(accessor) = self.accessors.last_mut() {
            (accessor["min"], accessor["max"]) = (json!(min), json!(max));
        }
        list
    }

    /// A list of numbers of four bytes, or of threes of such; its number.
    fn list(&mut self, bytes: Vec<u8>, target: u32, component: u32, kind: &str) -> Value {
        let size = if kind == "VEC3" { 12 } else { 4 };
        self.accessors.push(json!({
            "bufferView": self.views.len(),
            "componentType": component,
            "count": bytes.len() / size,
            "type": kind,
        }));
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": self.bytes.len(),
            "byteLength": bytes.len(),
            "target": target,
        }));
        self.bytes.extend(bytes);
        (self.accessors.len() - 1).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(vertices_m: &[DVec3]) -> Model<'_> {
        Model {
            name: "two points",
            cloud: Cloud {
                places_m: vec![DVec3::new(0.1, 1.0, -2.0), DVec3::new(0.0, 3.0, 8.0)],
                colours: vec![[255, 0, 128], [0, 0, 0]],
                values: vec![("power_dbm", vec![-60.0, -20.5])],
                extras: json!({ "power_dbm": "dBm" }),
            },
            paints: vec![Paint { name: "cotton", colour: [255, 0, 0], opacity: 0.5 }],
            surfaces: vec![
                Surface { name: "cloth", paint: 0, vertices_m, facets: vec![[1, 2, 3]] },
                Surface { name: "none", paint: 0, vertices_m, facets: vec![] },
            ],
            extras: json!({ "unit": "m" }),
        }
    }

    /// The JSON and the numbers of a file, whose lengths are right.
    fn chunks(file: &[u8]) -> (Value, &[u8]) {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (b"glTF".as_slice(), 2, file.len()));
        let end = HEADER + CHUNK + word(HEADER);
        assert_eq!((&file[HEADER + 4..HEADER + 8], end % 4), (b"JSON".as_slice(), 0));
        let json = serde_json::from_slice(&file[HEADER + CHUNK..end]).unwrap();
        if end == file.len() {
            return (json, &[]);
        }
        assert_eq!(&file[end + 4..end + CHUNK], b"BIN\0");
        let numbers = &file[end + CHUNK..];
        assert_eq!((numbers.len(), numbers.len() % 4), (word(end), 0));
        (json, numbers)
    }

    #[test]
    fn chunks_are_laid_out_as_the_format_has_them() {
        let vertices_m = [DVec3::NAN, DVec3::ZERO, DVec3::X, DVec3::Y];
        let file = write(&model(&vertices_m)).unwrap();
        let (json, numbers) = chunks(&file);
        assert_eq!(json["buffers"], json!([{ "byteLength": numbers.len() }]));
        let part = |list: &Value| {
            let accessor = &json["accessors"][list.as_u64().unwrap() as usize];
            let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let [from, length] =
                ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
            assert_eq!(from % 4, 0);
            (accessor, &numbers[from..from + length])
        };
        let floats = |bytes: &[u8]| {
            let words = bytes.as_chunks::<4>().0.iter();
            words.map(|word| f32::from_le_bytes(*word)).collect::<Vec<_>>()
        };
        let points = &json["meshes"][0]["primitives"][0];
        assert_eq!(
            (&points["mode"], &points["extras"]),
            (&json!(0), &json!({ "power_dbm": "dBm" }))
        );
        let (places, bytes) = part(&points["attributes"]["POSITION"]);
        assert_eq!(floats(bytes), [0.1, 1.0, -2.0, 0.0, 3.0, 8.0]);
        assert_eq!((&places["count"], &places["type"]), (&json!(2), &json!("VEC3")));
        assert_eq!(places["max"], json!([0.1f32, 3.0, 8.0]));
        let (colours, bytes) = part(&points["attributes"]["COLOR_0"]);
        assert_eq!((&colours["count"], &colours["type"]), (&json!(2), &json!("VEC3")));
        assert_eq!(floats(bytes), [1.0, 0.0, light_of_srgb(128), 0.0, 0.0, 0.0]);
        let (_, bytes) = part(&points["attributes"]["_POWER_DBM"]);
        assert_eq!(floats(bytes), [-60.0, -20.5]);
        // The surface without facets is left out, as is a vertex of no facet.
        assert_eq!(json["scenes"][0]["nodes"], json!([0, 1]));
        let surface = &json["meshes"][1]["primitives"][0];
        let (corners, bytes) = part(&surface["indices"]);
        assert_eq!((&corners["count"], bytes[4]), (&json!(3), 1));
        assert_eq!(
            floats(part(&surface["attributes"]["POSITION"]).1)[3..],
            [1., 0., 0., 0., 1., 0.]
        );
        let paint = &json["materials"][0];
        assert_eq!((&paint["name"], &paint["alphaMode"]), (&json!("cotton"), &json!("BLEND")));
        assert_eq!(json["scenes"][0]["extras"], json!({ "unit": "m" }));
    }

    #[test]
    fn a_file_of_nothing_has_no_empty_list() {
        let file = write(&Model::default()).unwrap();
        let (json, numbers) = chunks(&file);
        assert!(numbers.is_empty() && !json.to_string().contains("[]"), "{json}");
    }
}
