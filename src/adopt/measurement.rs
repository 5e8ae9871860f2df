//! A measured curve into a material, with the session in which it was measured.

use std::path::Path;

use super::admission;
use super::curve::{AddedCurve, CurveOrigin, add_curve};
use super::provenance::{activity, free_key};
use crate::error::Error;
use crate::material::{Material, Session, SessionPose};
use crate::measure::RegistrationResult;
use crate::report::MeasurementReport;
use crate::setup::{Database, find_material};
use crate::store::Store;

/// How a measured curve is to be stored.
#[derive(Clone, Debug)]
pub struct MeasurementStorage<'a> {
    /// The material that gets it, by its bare name.
    pub material: String,
    /// Name of the curve.
    pub curve: String,
    /// Where it comes from.
    pub origin: CurveOrigin,
    /// Day of the measurement, `YYYY-MM-DD`; with it a session is stored.
    pub date: Option<String>,
    /// The measured cloud.
    pub cloud: &'a Path,
    /// The scene that was measured.
    pub scene: &'a Path,
}

/// Where a measured curve was stored.
#[derive(Clone, Debug)]
pub struct StoredMeasurement {
    /// The material.
    pub material: String,
    /// Its new revision.
    pub revision: u32,
    /// Name of the curve.
    pub curve: String,
    /// What a person should not overlook.
    pub notices: Vec<String>,
}

/// That the circumstances of a measurement are not kept.
const NO_SESSION: &str = "no session is stored with the curve: --date YYYY-MM-DD, the day of the measurement, keeps \
                          the pose, what the registration left over and the cloud's hash, too";

impl MeasurementStorage<'_> {
    /// Checks, before anything is computed, that a curve can be stored; the material as it is now.
    ///
    /// # Errors
    /// A material that is not known, or a revision; an origin that is missing or not enough.
    pub fn check(&self, store: Option<&Store>) -> Result<Material, Error> {
        let name = &self.material;
        if name.contains('@') {
            return Err(Error::usage(
                format!("`{name}` names a revision, and a revision never changes"),
                "give the bare name; the curve becomes part of a new revision",
            ));
        }
        let material = find_material(store, name, "")?.material;
        self.origin.source(&material)?;
        self.origin.check(&material)?;
        Ok(material)
    }

    /// Checks, before anything is written, that this curve can be stored; what is doubtful about the material with it.
    ///
    /// # Errors
    /// A material that is not known, or a revision; an origin that is missing or not enough; a curve that the material
    /// has already; a day that is not one.
    pub fn admit(
        &self,
        measured: &MeasurementReport,
        store: Option<&Store>,
    ) -> Result<Vec<String>, Error> {
        let (material, _) = self.prepare(measured, store)?;
        Ok(admission::doubts(&material))
    }

    /// Stores the curve.
    ///
    /// # Errors
    /// A material or an origin with which the curve cannot be stored; a curve that the material has already; a database
    /// that cannot be written.
    pub fn save(
        &self,
        measured: &MeasurementReport,
        database: &Database,
    ) -> Result<StoredMeasurement, Error> {
        let mut store = database.write()?;
        let (material, AddedCurve { curve, .. }) = self.prepare(measured, Some(&store))?;
        store.record(activity("measure", &[self.cloud, self.scene])?);
        let added = store.add([&material])?;
        let notices = match self.date {
            Some(_) => Vec::new(),
            None => vec![NO_SESSION.to_owned()],
        };
        let revision = added.first().map_or(1, |added| added.revision());
        Ok(StoredMeasurement { material: self.material.clone(), revision, curve, notices })
    }

    /// The material with the curve and its session in it, and what was added.
    fn prepare(
        &self,
        measured: &MeasurementReport,
        store: Option<&Store>,
    ) -> Result<(Material, AddedCurve), Error> {
        let mut material = self.check(store)?;
        let curve = &measured.reduced.curve;
        let added = add_curve(&mut material, &self.curve, curve, &self.origin)?;
        if let Some(date) = &self.date {
            let session = session(date, self.cloud, &measured.registered)?;
            add_session(&mut material, &added.curve, session)?;
        }
        Ok((material, added))
    }
}

/// What is known of a measurement besides its points.
fn session(date: &str, cloud: &Path, registered: &RegistrationResult) -> Result<Session, Error> {
    let hash = activity("measure", &[cloud])?.inputs.into_iter().next();
    let pose = &registered.pose;
    let rotation_rows = [0, 1, 2].map(|row| pose.rotation().row(row).to_array());
    Ok(Session {
        key: String::new(),
        date: date.to_owned(),
        temperature_k: None,
        relative_humidity: None,
        cloud_hash: hash.map(|input| input.hash),
        mesh_hash: None,
        registration_rms_m: Some(registered.rms_m),
        normal_sd_rad: None,
        footprint_sd_rad: None,
        pose: Some(SessionPose { rotation_rows, translation_m: pose.translation_m().to_array() }),
        note: None,
    })
}

/// Adds a session under a free key to a curve that has none.
fn add_session(material: &mut Material, curve: &str, session: Session) -> Result<(), Error> {
    let key = free_key(curve, material.sessions.iter().map(|session| &session.key));
    let Some(curve) = material.curves.iter_mut().find(|known| known.name == curve) else {
        return Ok(());
    };
    if curve.session.is_none() {
        curve.session = Some(key.clone());
        material.sessions.push(Session { key, ..session });
    }
    Ok(material.validate()?)
}
