//! What every chirp looks at: labels of surfaces, by numbers that are the same in all scans.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::spec::Spec;
use crate::error::Error;
use crate::render::{Footprints, Setup};
use crate::scene::{MeshReport, SceneFile};
use crate::trace::Hit;

/// The names behind the numbers of labels. Instances count from 1, as 0 is no surface; regions and materials from 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Classes {
    /// Names of the meshes.
    pub instances: Vec<String>,
    /// Names of the regions.
    pub regions: Vec<String>,
    /// Names of the materials, in the order of the alphabet.
    pub materials: Vec<String>,
    /// Names of the meshes that are looked for.
    pub objects: Vec<String>,
}

/// What lies along the axis of a chirp's beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sight {
    /// An object that is looked for, or else the first surface that lets nothing through, or the last that the ray reaches.
    pub hit: Hit,
    /// Number of its mesh, from 1.
    pub instance: u16,
    /// Its region.
    pub region: u16,
    /// Its material.
    pub material: u16,
}

impl Classes {
    /// The classes of a data set.
    ///
    /// # Errors
    /// An object that is no mesh of the scene.
    pub fn new<'a>(
        spec: &Spec,
        file: &SceneFile,
        materials: impl Iterator<Item = &'a String>,
    ) -> Result<Classes, Error> {
        let instances: Vec<String> = file.mesh.iter().map(|mesh| mesh.name.clone()).collect();
        if let Some(object) = spec.objects.iter().find(|object| !instances.contains(object)) {
            return Err(Error::usage(
                format!("objects: the scene has no mesh `{object}`"),
                format!("there are: {}", instances.join(", ")),
            ));
        }
        let regions = file.region.iter().map(|region| region.name.clone()).collect();
        let materials = materials.cloned().collect();
        Ok(Classes { instances, regions, materials, objects: spec.objects.clone() })
    }

    /// Whether an instance is looked for.
    pub fn is_object(&self, instance: u16) -> bool {
        let name = usize::from(instance).checked_sub(1).and_then(|place| self.instances.get(place));
        name.is_some_and(|name| self.objects.contains(name))
    }
}

/// Numbers of instances and materials of a scan.
pub(super) struct Labels<'a> {
    classes: &'a Classes,
    meshes: &'a [MeshReport],
    /// For every region of the scene the number of its material among the classes.
    materials: Vec<u16>,
}

impl<'a> Labels<'a> {
    /// The labels of a scene whose regions have these materials.
    pub fn new<'m>(
        classes: &'a Classes,
        meshes: &'a [MeshReport],
        materials: impl Iterator<Item = &'m str>,
    ) -> Labels<'a> {
        let numbers: BTreeMap<&str, u16> =
            classes.materials.iter().map(String::as_str).zip(0..).collect();
        let materials = materials.map(|name| numbers.get(name).copied().unwrap_or(u16::MAX));
        Labels { classes, meshes, materials: materials.collect() }
    }

    /// Number of the mesh that a facet is of, from 1.
    pub fn instance(&self, facet: u32) -> u16 {
        self.meshes.partition_point(|mesh| mesh.first_facet <= facet as usize) as u16
    }

    /// Whether an instance is looked for.
    pub fn is_object(&self, instance: u16) -> bool {
        self.classes.is_object(instance)
    }

    /// Number of the material of a region.
    pub fn material(&self, region: u16) -> u16 {
        self.materials[usize::from(region)]
    }

    /// What lies along every chirp's axis, none where it hits nothing, and the share of the rays of its spot that meet an object
    /// that is looked for. Of several rays the first is the nearest to the axis.
    pub fn sights(&self, setup: &Setup, footprints: &Footprints) -> (Vec<Option<Sight>>, Vec<f32>) {
        let rays = footprints.rays_per_chirp.max(1);
        let layers: Vec<&[Option<Hit>]> = std::iter::once(&footprints.hits)
            .chain(footprints.behind.iter().map(|behind| &behind.hits))
            .map(Vec::as_slice)
            .collect();
        let is_on_object = |hit: &Hit| self.is_object(self.instance(hit.facet));
        let shown = |ray: usize| {
            let on_its_way = || layers.iter().filter_map(|layer| layer[ray]);
            on_its_way().find(is_on_object).or_else(|| on_its_way().next_back())
        };
        let (mut sights, mut object_shares) = (Vec::new(), Vec::new());
        for first in (0..footprints.hits.len()).step_by(rays) {
            let spot = first..first + rays;
            let on_object = spot.filter(|&ray| shown(ray).is_some_and(|hit| is_on_object(&hit)));
            object_shares.push(on_object.count() as f32 / rays as f32);
            sights.push(shown(first).map(|hit| {
                let region = setup.geometry.region_of_facet[hit.facet as usize];
                let (instance, material) = (self.instance(hit.facet), self.material(region));
                Sight { hit, instance, region, material }
            }));
        }
        (sights, object_shares)
    }
}
