//! Triangle meshes.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

/// A triangle mesh: shared vertices, facets as vertex triples, and any number of per-facet labels.
///
/// Coordinates are metres in whatever frame the owner says. Facets are two-sided.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, m.
    pub vertices: Vec<DVec3>,
    /// Three vertex indices per facet.
    pub facets: Vec<[u32; 3]>,
    /// Named partitions of the facets: an OBJ material, a PLY face property, a body part.
    pub labels: Vec<FacetLabels>,
}

/// One partition of a mesh's facets into named parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FacetLabels {
    /// What the partition is by: `usemtl`, `group`, `solid`, `part`, or a PLY face property's own name.
    pub property: String,
    /// The parts' names.
    pub names: Vec<String>,
    /// For each facet, an index into `names`.
    pub name_of_facet: Vec<u32>,
}

impl FacetLabels {
    /// Builds labels from one name per facet; names are numbered in order of first appearance.
    ///
    /// ```
    /// use matdb::geometry::FacetLabels;
    /// let labels = FacetLabels::from_names("part", ["arm", "leg", "arm"]);
    /// assert_eq!(labels.names, ["arm", "leg"]);
    /// assert_eq!(labels.name_of_facet, [0, 1, 0]);
    /// ```
    pub fn from_names<S: AsRef<str>>(
        property: &str,
        names: impl IntoIterator<Item = S>,
    ) -> FacetLabels {
        let mut builder = LabelBuilder::new(property);
        names.into_iter().for_each(|name| builder.push(name.as_ref(), 1));
        builder.finish()
    }
}

impl FacetLabels {
    /// So many facets with the empty name.
    fn unnamed(property: &str, facets: usize) -> FacetLabels {
        let mut builder = LabelBuilder::new(property);
        if facets > 0 {
            builder.push("", facets);
        }
        builder.finish()
    }

    /// Appends the names of further facets.
    fn append(&mut self, other: &FacetLabels) {
        let mut number_of_name: HashMap<String, u32> =
            std::iter::zip(self.names.iter().cloned(), 0..).collect();
        let renumbered: Vec<u32> = other
            .names
            .iter()
            .map(|name| {
                *number_of_name.entry(name.clone()).or_insert_with(|| {
                    self.names.push(name.clone());
                    self.names.len() as u32 - 1
                })
            })
            .collect();
        self.name_of_facet.extend(other.name_of_facet.iter().map(|&n| renumbered[n as usize]));
    }
}

/// Builds [`FacetLabels`] as facets come in.
#[derive(Debug)]
pub struct LabelBuilder {
    labels: FacetLabels,
    number_of_name: HashMap<String, u32>,
}

impl LabelBuilder {
    /// No facets yet.
    pub fn new(property: &str) -> LabelBuilder {
        let labels = FacetLabels { property: property.to_owned(), ..Default::default() };
        LabelBuilder { labels, number_of_name: HashMap::new() }
    }

    /// Gives the next `facets` facets the name `name`; names are numbered in order of first appearance.
    pub fn push(&mut self, name: &str, facets: usize) {
        if facets == 0 {
            return;
        }
        let number = self.number(name);
        self.labels.name_of_facet.extend(std::iter::repeat_n(number, facets));
    }

    /// The labels of all facets so far.
    pub fn finish(self) -> FacetLabels {
        self.labels
    }

    fn number(&mut self, name: &str) -> u32 {
        // Neighbouring facets mostly share their name.
        let FacetLabels { names, name_of_facet, .. } = &mut self.labels;
        if let Some(&last) = name_of_facet.last()
            && names.get(last as usize).is_some_and(|last| last == name)
        {
            return last;
        }
        if let Some(&number) = self.number_of_name.get(name) {
            return number;
        }
        let number = names.len() as u32;
        names.push(name.to_owned());
        self.number_of_name.insert(name.to_owned(), number);
        number
    }
}

/// Why a mesh cannot be used.
#[derive(Debug, Error, PartialEq)]
pub enum MeshError {
    /// There is nothing to hit.
    #[error("the mesh has no facets; check that the file holds triangles and not only points")]
    NoFacets,
    /// Facets exist, but none has an area.
    #[error("none of the {facets} facets has an area; check the scale and the export of the mesh")]
    NoArea {
        /// How many facets there are.
        facets: usize,
    },
    /// More facets or vertices than 32-bit indices can address.
    #[error("the mesh has {count} {what}; at most 2³² − 1 can be addressed, so split the mesh")]
    TooLarge {
        /// `vertices` or `facets`.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A facet refers to a vertex that does not exist.
    #[error(
        "facet {facet} refers to vertex {index}, but the mesh has {vertices} vertices; \
         re-export the mesh"
    )]
    IndexOutOfRange {
        /// Facet number, from 0.
        facet: usize,
        /// The offending vertex index.
        index: i64,
        /// Number of vertices.
        vertices: usize,
    },
    /// A vertex is NaN or infinite.
    #[error("vertex {vertex} is not finite ({x}, {y}, {z}); repair the mesh")]
    NotFinite {
        /// Vertex number, from 0.
        vertex: usize,
        /// Its coordinates.
        x: f64,
        #[allow(missing_docs)]
        y: f64,
        #[allow(missing_docs)]
        z: f64,
    },
}

impl Mesh {
    /// Checks what every later stage relies on: facets exist, indices are in range, vertices finite.
    pub fn validate(&self) -> Result<(), MeshError> {
        for (what, count) in [("vertices", self.vertices.len()), ("facets", self.facets.len())] {
            if count > u32::MAX as usize {
                return Err(MeshError::TooLarge { what, count });
            }
        }
        if self.facets.is_empty() {
            return Err(MeshError::NoFacets);
        }
        if let Some((vertex, &DVec3 { x, y, z })) = first(&self.vertices, |v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex, x, y, z });
        }
        let vertices = self.vertices.len();
        let is_stray = |&&index: &&u32| index as usize >= vertices;
        let stray = |facet: &[u32; 3]| facet.iter().find(is_stray).copied();
        match first(&self.facets, |facet| facet.iter().fold(false, |bad, i| bad | is_stray(&i))) {
            Some((facet, indices)) => {
                let index = stray(indices).unwrap_or_default().into();
                Err(MeshError::IndexOutOfRange { facet, index, vertices })
            }
            None => Ok(()),
        }
    }

    /// Adds facets of vertices that are there, without names.
    pub fn push_unnamed(&mut self, facets: Vec<[u32; 3]>) {
        for labels in &mut self.labels {
            labels.append(&FacetLabels::unnamed(&labels.property, facets.len()));
        }
        if self.facets.is_empty() {
            self.facets = facets;
        } else {
            self.facets.extend(facets);
        }
    }

    /// Without the vertices that no facet has, where one of these is not finite: tools mark removed ones so.
    #[must_use]
    pub fn without_removed_vertices(mut self) -> Mesh {
        if self.vertices.iter().all(|vertex| vertex.is_finite()) {
            return self;
        }
        let mut is_used = vec![false; self.vertices.len()];
        for &index in self.facets.as_flattened() {
            // `validate` names an index beyond the vertices.
            let Some(used) = is_used.get_mut(index as usize) else { return self };
            *used = true;
        }
        let are_finite =
            std::iter::zip(&self.vertices, &is_used).all(|(v, used)| !used || v.is_finite());
        if !are_finite {
            return self;
        }
        let mut next = 0;
        let renumbered: Vec<u32> = (is_used.iter())
            .map(|&used| {
                next += u32::from(used);
                next.saturating_sub(1)
            })
            .collect();
        let mut used = is_used.into_iter();
        self.vertices.retain(|_| used.next().unwrap_or(true));
        self.facets.as_flattened_mut().iter_mut().for_each(|i| *i = renumbered[*i as usize]);
        self
    }

    /// The corners of a facet, m. Panics when `facet` is out of range.
    #[inline]
    pub fn corners(&self, facet: usize) -> [DVec3; 3] {
        self.facets[facet].map(|v| self.vertices[v as usize])
    }

    /// Twice the facet's area times its right-handed unit normal, m²; zero for a degenerate facet.
    #[inline]
    pub fn area_normal(&self, facet: usize) -> DVec3 {
        let [a, b, c] = self.corners(facet);
        (b - a).cross(c - a)
    }

    /// Centroid of a facet, m.
    pub fn centroid(&self, facet: usize) -> DVec3 {
        let [a, b, c] = self.corners(facet);
        (a + b + c) / 3.0
    }

    /// Unit normals at the vertices, the mean over the facets that meet there by their areas; zero where no facet does.
    /// They point outwards where facets run anticlockwise seen from outside.
    pub fn vertex_normals(&self) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.vertices.len()];
        for (number, facet) in self.facets.iter().enumerate() {
            let normal = self.area_normal(number);
            facet.iter().for_each(|&vertex| normals[vertex as usize] += normal);
        }
        normals.into_iter().map(DVec3::normalize_or_zero).collect()
    }

    /// A mesh of some of the facets, in this order, with their labels. It keeps all vertices.
    pub fn only(mut self, facets: &[usize]) -> Mesh {
        self.facets = facets.iter().map(|&facet| self.facets[facet]).collect();
        for labels in &mut self.labels {
            let names = facets.iter().map(|&facet| labels.name_of_facet[facet]);
            labels.name_of_facet = names.collect();
        }
        self
    }

    /// Whether a facet has no area: repeated or collinear corners.
    ///
    /// The bound is relative to the longest edge, so that small and large meshes are judged alike.
    pub fn is_degenerate(&self, facet: usize) -> bool {
        const RELATIVE_HEIGHT: f64 = 1e-12;
        let [a, b, c] = self.corners(facet);
        let longest2 =
            (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let height2 = self.area_normal(facet).length();
        height2.is_nan() || height2 <= RELATIVE_HEIGHT * longest2
    }

    /// Appends another mesh. Labels are kept by property; facets without a label get the empty name.
    ///
    /// # Errors
    /// When the two together have more vertices or facets than 32 bits can number; nothing is
    /// appended then.
    pub fn append(&mut self, other: &Mesh) -> Result<(), MeshError> {
        let facets = self.facets.len() + other.facets.len();
        let vertices = self.vertices.len() + other.vertices.len();
        for (what, count) in [("vertices", vertices), ("facets", facets)] {
            if count > u32::MAX as usize {
                return Err(MeshError::TooLarge { what, count });
            }
        }
        for theirs in &other.labels {
            if !self.labels.iter().any(|l| l.property == theirs.property) {
                self.labels.push(FacetLabels::unnamed(&theirs.property, self.facets.len()));
            }
        }
        for ours in &mut self.labels {
            match other.labels.iter().find(|l| l.property == ours.property) {
                Some(theirs) => ours.append(theirs),
                None => ours.append(&FacetLabels::unnamed("", other.facets.len())),
            }
        }
        let vertex_offset = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.facets.extend(other.facets.iter().map(|f| f.map(|v| v + vertex_offset)));
        Ok(())
    }
}

/// The first item that is wrong, with its number.
fn first<T: Sync>(items: &[T], is_wrong: impl Fn(&T) -> bool + Sync) -> Option<(usize, &T)> {
    /// Items whose tests are joined without a branch.
    const TOGETHER: usize = 1 << 13;
    let any = |chunk: &[T]| chunk.iter().fold(false, |any, item| any | is_wrong(item));
    let chunk = items.par_chunks(TOGETHER).position_first(any)?;
    items.iter().enumerate().skip(chunk * TOGETHER).find(|(_, item)| is_wrong(item))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_fault_is_told_however_many_there_are() {
        let count = 100_000;
        let good = Mesh {
            vertices: vec![DVec3::ONE; count],
            facets: vec![[0, 1, 2]; count],
            labels: vec![],
        };
        assert_eq!(good.validate(), Ok(()));
        let mut stray = good.clone();
        for facet in [99_999, 70_001, 90_000] {
            stray.facets[facet] = [0, 100_000 + facet as u32, u32::MAX];
        }
        let vertices = count;
        let expected = MeshError::IndexOutOfRange { facet: 70_001, index: 170_001, vertices };
        assert_eq!(stray.validate(), Err(expected));
        for vertex in [80_000, 30_000, 99_999] {
            stray.vertices[vertex].y = f64::INFINITY;
        }
        let expected = MeshError::NotFinite { vertex: 30_000, x: 1.0, y: f64::INFINITY, z: 1.0 };
        assert_eq!(stray.validate(), Err(expected));
    }

    #[test]
    fn some_facets_keep_their_labels_and_normals_are_those_of_the_facets() {
        let mesh = Mesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE],
            facets: vec![[0, 1, 2], [1, 3, 2]],
            labels: vec![FacetLabels::from_names("part", ["arm", "leg"])],
        };
        let leg = mesh.clone().only(&[1]);
        assert_eq!(
            (leg.facets.as_slice(), leg.labels[0].name_of_facet.as_slice()),
            (&[[1, 3, 2]][..], &[1][..])
        );
        let normals = leg.vertex_normals();
        assert_eq!(normals[0], DVec3::ZERO);
        assert!(normals[3].dot(mesh.area_normal(1).normalize()) > 1.0 - 1e-12);
        assert!(mesh.vertex_normals()[0].distance(DVec3::Z) < 1e-12);
    }

    #[test]
    fn removed_vertices_are_no_part_of_a_mesh() {
        let corner = |x: f64| DVec3::new(x, x * x, 1.0);
        let mesh = Mesh {
            vertices: vec![corner(0.0), DVec3::NAN, corner(1.0), corner(2.0), corner(3.0)],
            facets: vec![[0, 2, 4]],
            labels: vec![],
        };
        let kept = mesh.clone().without_removed_vertices();
        assert_eq!((kept.vertices.len(), kept.facets.as_slice()), (3, [[0, 1, 2]].as_slice()));
        assert_eq!(kept.corners(0), mesh.corners(0));
        // One that a facet has is an error, by its own number.
        let damaged = Mesh { facets: vec![[0, 1, 4]], ..mesh };
        let damaged = damaged.without_removed_vertices();
        assert!(matches!(damaged.validate(), Err(MeshError::NotFinite { vertex: 1, .. })));
    }

    #[test]
    fn labels_are_joined_by_name() {
        let part = |names: &[&str]| Mesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            facets: vec![[0, 1, 2]; names.len()],
            labels: vec![FacetLabels::from_names("part", names)],
        };
        let mut mesh = part(&["arm", "leg"]);
        mesh.append(&part(&["leg", "head"])).unwrap();
        mesh.append(&Mesh { labels: vec![], ..part(&["x"]) }).unwrap();
        let labels = &mesh.labels[0];
        let names = labels.name_of_facet.iter().map(|&n| labels.names[n as usize].as_str());
        assert_eq!(names.collect::<Vec<_>>(), ["arm", "leg", "leg", "head", ""]);
        assert_eq!(mesh.facets[2], [3, 4, 5]);
    }
}
