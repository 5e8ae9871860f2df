//! Regions: which facets are made of what. Later regions win.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use super::file::{BoxEntry, HalfSpaceEntry, RegionEntry, SphereEntry};
use crate::formats::text::nearest;
use crate::geometry::Mesh;

/// Why facets cannot be assigned.
#[derive(Debug, Error, PartialEq)]
pub enum RegionError {
    /// Nothing is selected.
    #[error("region `{region}` selects no facet; {way_out}")]
    Empty {
        /// The region.
        region: String,
        /// What may be wrong.
        way_out: String,
    },
    /// A mesh that is not there.
    #[error("region `{region}` is of mesh `{mesh}`, which the scene does not have; {way_out}")]
    UnknownMesh {
        /// The region.
        region: String,
        /// The name it gives.
        mesh: String,
        /// The nearest name, or all.
        way_out: String,
    },
    /// Facets that no region claims.
    #[error(
        "{count} facets of mesh `{mesh}` belong to no region; add a first [[region]] without \
         selectors, with the material of everything else"
    )]
    Unclaimed {
        /// Number of facets.
        count: usize,
        /// Their mesh.
        mesh: String,
    },
    /// Two regions of one name.
    #[error("two regions are named `{region}`; rename one")]
    Twice {
        /// The name.
        region: String,
    },
    /// A selector that means nothing.
    #[error("region `{region}`: {problem}")]
    Selector {
        /// The region.
        region: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// More regions than the cloud can number.
    #[error("the scene has {count} regions; at most 65 535 can be numbered, so merge some")]
    TooMany {
        /// How many there are.
        count: usize,
    },
}

/// Facets `first..end` of the target came from the mesh `name`.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSpan {
    /// Name of the mesh.
    pub name: String,
    /// Its first facet.
    pub first: usize,
    /// One past its last facet.
    pub end: usize,
}

/// The region of a facet that none has claimed; regions are too few to reach it.
const UNCLAIMED: u16 = u16::MAX;

/// Index of the region of every facet: the last of `regions` that selects it.
pub fn assign(
    mesh: &Mesh,
    spans: &[MeshSpan],
    regions: &[RegionEntry],
) -> Result<Vec<u16>, RegionError> {
    if regions.len() > usize::from(u16::MAX) {
        return Err(RegionError::TooMany { count: regions.len() });
    }
    let mut assigned = vec![UNCLAIMED; mesh.facets.len()];
    for (number, region) in regions.iter().enumerate() {
        if regions[..number].iter().any(|earlier| earlier.name == region.name) {
            return Err(RegionError::Twice { region: region.name.clone() });
        }
        claim(&mut assigned, number as u16, mesh, spans, region)?;
    }
    for span in spans {
        let count = assigned[span.first..span.end].iter().filter(|&&a| a == UNCLAIMED).count();
        if count > 0 {
            return Err(RegionError::Unclaimed { count, mesh: span.name.clone() });
        }
    }
    Ok(assigned)
}

/// Gives the facets that a region selects its number.
fn claim(
    assigned: &mut [u16],
    number: u16,
    mesh: &Mesh,
    spans: &[MeshSpan],
    region: &RegionEntry,
) -> Result<(), RegionError> {
    let facets = facets_of_mesh(mesh, spans, region)?;
    let labels = region.facets.iter();
    let labels: Vec<(&[u32], u32)> = labels
        .map(|(property, value)| label_number(mesh, region, property, &value.to_string()))
        .collect::<Result<_, _>>()?;
    let tests = geometric_tests(region)?;
    let is_inside = |centroid: DVec3| tests.iter().all(|inside| inside(centroid));
    let is_selected = |facet: usize| {
        labels.iter().all(|(name_of_facet, wanted)| name_of_facet[facet] == *wanted)
            && (tests.is_empty() || is_inside(mesh.centroid(facet)))
    };
    let of_mesh = assigned[facets.clone()].par_iter_mut().zip(facets);
    let selected = of_mesh.filter(|(_, facet)| is_selected(*facet));
    if selected.map(|(assigned, _)| *assigned = number).count() == 0 {
        let way_out = format!(
            "{}; move or widen its selectors",
            span_text(mesh, spans, region.mesh.as_deref())
        );
        return Err(RegionError::Empty { region: region.name.clone(), way_out });
    }
    Ok(())
}

fn facets_of_mesh(
    mesh: &Mesh,
    spans: &[MeshSpan],
    region: &RegionEntry,
) -> Result<Range<usize>, RegionError> {
    let Some(wanted) = &region.mesh else {
        return Ok(0..mesh.facets.len());
    };
    match spans.iter().find(|span| span.name == *wanted) {
        Some(span) => Ok(span.first..span.end),
        None => Err(RegionError::UnknownMesh {
            region: region.name.clone(),
            mesh: wanted.clone(),
            way_out: suggest(wanted, spans.iter().map(|span| span.name.as_str())),
        }),
    }
}

/// The label of each facet and the one that is wanted, or the names that would have been valid.
fn label_number<'a>(
    mesh: &'a Mesh,
    region: &RegionEntry,
    property: &str,
    value: &str,
) -> Result<(&'a [u32], u32), RegionError> {
    let refuse = |problem| RegionError::Selector { region: region.name.clone(), problem };
    let properties = || mesh.labels.iter().map(|l| l.property.as_str());
    let Some(labels) = mesh.labels.iter().find(|l| l.property == property) else {
        let way_out = suggest(property, properties());
        return Err(refuse(format!("no mesh labels its facets by `{property}`; {way_out}")));
    };
    let Some(wanted) = labels.names.iter().position(|name| name == value) else {
        let way_out = suggest(value, labels.names.iter().map(String::as_str));
        return Err(refuse(format!("no facet has {property} = `{value}`; {way_out}")));
    };
    Ok((&labels.name_of_facet, wanted as u32))
}

type Inside = Box<dyn Fn(DVec3) -> bool + Sync>;

fn geometric_tests(region: &RegionEntry) -> Result<Vec<Inside>, RegionError> {
    let refuse = |problem: &str| RegionError::Selector {
        region: region.name.clone(),
        problem: problem.to_owned(),
    };
    let mut tests: Vec<Inside> = Vec::new();
    if let Some(BoxEntry { min_m, max_m }) = region.within_box {
        let (min, max) = (DVec3::from(min_m), DVec3::from(max_m));
        if !min.cmple(max).all() {
            return Err(refuse("box.min_m is not below box.max_m; swap the coordinates"));
        }
        tests.push(Box::new(move |p| p.cmpge(min).all() && p.cmple(max).all()));
    }
    if let Some(SphereEntry { centre_m, radius_m }) = region.sphere {
        let centre = DVec3::from(centre_m);
        if !(radius_m > 0.0 && centre.is_finite()) {
            return Err(refuse("sphere.radius_m must be positive; give it in metres"));
        }
        tests.push(Box::new(move |p| p.distance_squared(centre) <= radius_m * radius_m));
    }
    if let Some(HalfSpaceEntry { point_m, normal }) = region.half_space {
        let (point, normal) = (DVec3::from(point_m), DVec3::from(normal));
        if !(normal.length() > 0.0 && normal.is_finite() && point.is_finite()) {
            return Err(refuse(
                "half_space.normal has no direction; give a vector such as [0, 1, 0]",
            ));
        }
        tests.push(Box::new(move |p| (p - point).dot(normal) >= 0.0));
    }
    Ok(tests)
}

fn suggest<'a>(wanted: &str, names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
    match nearest(wanted, names.iter().copied()) {
        Some(name) => format!("did you mean `{name}`?"),
        None if names.is_empty() => "there are none to choose from".to_owned(),
        None => format!("there are: {}", names.join(", ")),
    }
}

/// Where the facets are, for an error about a selector that misses them.
fn span_text(mesh: &Mesh, spans: &[MeshSpan], name: Option<&str>) -> String {
    let inside = |facet: &usize| {
        name.is_none_or(|name| {
            spans.iter().any(|s| s.name == name && (s.first..s.end).contains(facet))
        })
    };
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for facet in (0..mesh.facets.len()).filter(inside) {
        let centroid = mesh.centroid(facet);
        min = min.min(centroid);
        max = max.max(centroid);
    }
    format!(
        "facets lie within x {:.3} to {:.3}, y {:.3} to {:.3}, z {:.3} to {:.3} m",
        min.x, max.x, min.y, max.y, min.z, max.z
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::FacetLabels;
    use crate::scene::file::SceneFile;

    /// Four facets along x, labelled a, a, b, b; the last two belong to the second mesh.
    fn row() -> (Mesh, Vec<MeshSpan>) {
        let corners =
            |x: f64| [DVec3::new(x, 0.0, 0.0), DVec3::new(x, 1.0, 0.0), DVec3::X * (x + 0.5)];
        let mesh = Mesh {
            vertices: (0..4).flat_map(|i| corners(f64::from(i))).collect(),
            facets: (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            labels: vec![FacetLabels::from_names("part", ["a", "a", "b", "b"])],
        };
        let span = |name: &str, first, end| MeshSpan { name: name.into(), first, end };
        (mesh, vec![span("one", 0, 2), span("two", 2, 4)])
    }

    fn regions(text: &str) -> Result<Vec<u16>, RegionError> {
        let (mesh, spans) = row();
        assign(&mesh, &spans, &SceneFile::parse(text).unwrap().region)
    }

    const ALL: &str = "[[region]]\nname = \"all\"\nmaterial = \"ptfe\"\n";

    fn with(selector: &str) -> Result<Vec<u16>, RegionError> {
        regions(&format!("{ALL}[[region]]\nname = \"part\"\nmaterial = \"glass\"\n{selector}\n"))
    }

    #[test]
    fn selectors_pick_facets_and_later_regions_win() {
        for (selector, expected) in [
            ("mesh = \"two\"", [0, 0, 1, 1]),
            ("facets = { part = \"a\" }", [1, 1, 0, 0]),
            ("box = { min_m = [0.5, -1, -1], max_m = [2.5, 2, 1] }", [0, 1, 1, 0]),
            ("sphere = { centre_m = [0, 0, 0], radius_m = 1.0 }", [1, 0, 0, 0]),
            ("half_space = { point_m = [3, 0, 0], normal = [1, 0, 0] }", [0, 0, 0, 1]),
            (
                "mesh = \"one\"\nhalf_space = { point_m = [1, 0, 0], normal = [1, 0, 0] }",
                [0, 1, 0, 0],
            ),
        ] {
            assert_eq!(with(selector).unwrap(), expected, "{selector}");
        }
    }

    #[test]
    fn mistakes_are_explained() {
        for (selector, expected) in [
            ("mesh = \"tow\"", "did you mean `two`?"),
            ("facets = { prat = \"a\" }", "did you mean `part`?"),
            ("facets = { part = \"c\" }", "there are: a, b"),
            (
                "box = { min_m = [9, 9, 9], max_m = [10, 10, 10] }",
                "selects no facet; facets lie within x 0.167",
            ),
            ("box = { min_m = [1, 0, 0], max_m = [0, 1, 1] }", "swap"),
            ("sphere = { centre_m = [0, 0, 0], radius_m = -1.0 }", "radius_m must be positive"),
            ("half_space = { point_m = [3, 0, 0], normal = [0, 0, 0] }", "no direction"),
        ] {
            let message = with(selector).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        let unclaimed = ALL.replace("material", "mesh = \"one\"\nmaterial");
        assert!(regions(&unclaimed).unwrap_err().to_string().contains("2 facets of mesh `two`"));
        assert!(matches!(regions(&ALL.repeat(2)), Err(RegionError::Twice { .. })));
    }
}
