//! A rendering, as arrays and as files.

use std::path::PathBuf;

use matdb::error::Error;
use matdb::files::{folder_of, write_all};
use matdb::formats::exr::Packing;
use matdb::formats::ply::{Column, Scalar, Table};
use matdb::geometry::Raster;
use matdb::geometry::raster::Channel;
use matdb::render::{Echo, RenderError, cloud_table};
use matdb::report::{BeatShape, RenderFiles, RenderRequest, rendering_glb, rendering_page};
use matdb::setup::{ReadyScene, View as Received};
use matdb::trace::{Gpu, GpuError, Tracer};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::cloud::Cloud;
use crate::database::Database;
use crate::error::{no_choice, raised, warn};
use crate::interrupt::interruptible;
use crate::numbers::seed_if_any;
use crate::scene::{Scene, SceneLike};
use crate::table;
use crate::words::in_python;

/// What one antenna received in one polarisation.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct View {
    /// Channels of the image by their names.
    image: Py<PyDict>,
    /// Columns of the cloud by their names.
    cloud: Py<PyDict>,
    x_m: Py<PyArray1<f64>>,
    y_m: Py<PyArray1<f64>>,
    /// x of the image's left edge and y of its lower one, m.
    corner_m: [f64; 2],
    /// Side of a pixel, m.
    pixel_m: f64,
    threshold_w: f64,
}

/// A rendering of a scene.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Scan {
    scene: Py<Scene>,
    files: Vec<(String, Vec<u8>)>,
    /// The radar's own view first.
    views: Vec<(String, Py<View>)>,
    notices: Vec<String>,
    /// Names of the scene's materials.
    materials: Vec<String>,
}

/// What is known of a rendering before there are arrays.
struct Rendered {
    files: Vec<(String, Vec<u8>)>,
    /// Name, cloud, image and threshold of each antenna.
    views: Vec<(String, Table, Raster, f64)>,
    notices: Vec<String>,
    materials: Vec<String>,
}

/// A page that stands alone, for a browser or a notebook.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Page {
    html: String,
}

/// Renders a scene on all cores. Ctrl-C ends it.
///
/// Parameters
/// ----------
/// scene : Scene, str or os.PathLike
/// db : Database, optional
///     Where its materials are looked for; without it, and for those that it does not have, the built-in ones.
/// seed : int, optional
///     In the place of the scene's own. Meshes are not loaded again.
/// all_hits : bool, default False
///     Whether the files `cloud.ply` hold every hit, not only detections.
/// view : bool, default False
///     Whether there are files `view.html`, too, as `Scan.show` makes them.
/// glb : bool, default False
///     Whether there are files `cloud.glb`, too, as `Scan.glb` makes them.
/// beat : bool, default False
///     Whether there are files `beat.npy`, too: the beat signals of a radar with a receiver.
/// crop : bool, default False
///     Whether the images end a spot beyond what any antenna detected.
/// uncompressed : bool, default False
///     Whether `power.exr` is not compressed.
/// tracer : str, optional
///     How rays are traced: `pinhole`, `bvh`, `brute` or `gpu`; the fastest unless stated.
///
/// Returns
/// -------
/// Scan
///
/// Raises
/// ------
/// matdb.MaterialError, matdb.RenderError
///     Materials that are not known, and what cannot be rendered.
#[pyfunction]
#[pyo3(signature = (scene, *, db = None, seed = None, all_hits = false, view = false, glb = false, beat = false,
                    crop = false, uncompressed = false, tracer = None))]
#[expect(clippy::too_many_arguments, reason = "each is a keyword in Python")]
pub(crate) fn render(
    py: Python<'_>,
    scene: SceneLike,
    db: Option<&Database>,
    #[pyo3(from_py_with = seed_if_any)] seed: Option<u64>,
    all_hits: bool,
    view: bool,
    glb: bool,
    beat: bool,
    crop: bool,
    uncompressed: bool,
    tracer: Option<&str>,
) -> PyResult<Scan> {
    let own_tracer = match tracer {
        None | Some("gpu") => Tracer::Automatic,
        Some("pinhole") => Tracer::Pinhole,
        Some("bvh") => Tracer::Bvh,
        Some("brute") => Tracer::Brute,
        Some(other) => return Err(no_choice("tracer", other, "pinhole, bvh, brute or gpu")),
    };
    let mut scene = scene.scene(py)?;
    if let Some(seed) = seed {
        let changes = PyDict::new(py);
        changes.set_item("seed", seed)?;
        scene = Py::new(py, scene.get().with(py, &changes)?)?;
    }
    let own = scene.get();
    let effects = own.own_effects(py)?;
    let rendered = interruptible(py, |stop| {
        let store = db.map_or(Ok(None), Database::read)?;
        let ready = ReadyScene::new(own.scene().clone(), own.path(), store.as_ref())?;
        let ready = ready.with_own_effects(effects);
        drop(store);
        let gpu = match (tracer == Some("gpu")).then(Gpu::new).transpose() {
            Err(GpuError::NoAdapter { .. }) => None,
            gpu => {
                gpu.map_err(|error| ready.render_error("", RenderError::Tracer(error.into())))?
            }
        };
        let request = RenderRequest {
            tracer: own_tracer,
            gpu: gpu.as_ref(),
            all_hits,
            beat: beat.then(|| BeatShape::new(&ready.scene)).transpose()?,
            view,
            glb,
            crop,
            packing: if uncompressed { Packing::Uncompressed } else { Packing::Zip16 },
            ..RenderRequest::new(&ready)
        };
        Ok((Rendered::new(&request, &|| stop.check())?, gpu.is_some()))
    })?;
    let (rendered, is_on_gpu) = rendered.map_err(raised::<Error>)?;
    if tracer == Some("gpu") && !is_on_gpu {
        warn(py, &["there is no graphics processor; traced on the processor instead".to_owned()])?;
    }
    Scan::new(py, scene, rendered)
}

impl Rendered {
    fn new(request: &RenderRequest<'_>, check: &(dyn Fn() + Sync)) -> Result<Rendered, Error> {
        let RenderFiles { views, images, record, files } = request.render(&|_| check())?;
        let materials = record.material_names();
        let mut named = Vec::new();
        for (view, image) in std::iter::zip(&views, images) {
            check();
            let name = view.file_name("view", "");
            let name = name.trim_end_matches('.').replacen("view", "radar", 1);
            named.push((
                name,
                table(request.ready, view, &materials),
                image,
                view.scan.threshold_w,
            ));
        }
        Ok(Rendered { files, views: named, notices: record.notices(), materials })
    }
}

impl Scan {
    fn new(py: Python<'_>, scene: Py<Scene>, rendered: Rendered) -> PyResult<Scan> {
        let Rendered { files, views, notices, materials } = rendered;
        let views = views.into_iter().map(|(name, table, image, threshold_w)| {
            Ok((name, Py::new(py, View::new(py, table, threshold_w, image)?)?))
        });
        Ok(Scan { scene, files, views: views.collect::<PyResult<_>>()?, notices, materials })
    }

    fn radar<'a, 'py>(&'a self, py: Python<'py>) -> PyResult<&'a Bound<'py, View>> {
        let (_, view) = self.views.first().ok_or_else(|| PyKeyError::new_err("no view"))?;
        Ok(view.bind(py))
    }

    /// A view by its name.
    fn view(&self, wanted: &str) -> PyResult<&Py<View>> {
        let named = self.views.iter().find(|(name, _)| name == wanted);
        named.map(|(_, view)| view).ok_or_else(|| {
            let names: Vec<&str> = self.views.iter().map(|(name, _)| name.as_str()).collect();
            no_choice("view", wanted, &names.join(", "))
        })
    }

    /// What the radar measured, as points.
    pub(crate) fn points(&self, py: Python<'_>) -> PyResult<Cloud> {
        let mut columns = self.radar(py)?.get().table(py)?.columns;
        columns.retain(|column| MEASURED.contains(&column.name.as_str()));
        let columns = columns.into_iter().map(|column| (column.name, column.values));
        Cloud::of_columns(columns.collect()).map_err(raised)
    }
}

/// Columns of what is measured of a detection.
const MEASURED: [&str; 6] = ["x", "y", "z", "power_dbm", "chirp", "range_m"];

impl View {
    fn new(py: Python<'_>, table: Table, threshold_w: f64, raster: Raster) -> PyResult<View> {
        let cloud = PyDict::new(py);
        for column in table.columns {
            let name = with_unit(&column.name).to_owned();
            cloud.set_item(name, frozen(&array(py, column)?)?)?;
        }
        let [x_m, y_m] = [
            (0..raster.width).map(|column| raster.x_m(column)).collect::<Vec<_>>(),
            (0..raster.height).map(|row| raster.y_m(row)).collect(),
        ]
        .map(|values| PyArray1::from_vec(py, values));
        let image = PyDict::new(py);
        let shape = [raster.height, raster.width];
        for channel in raster.channels {
            let values = PyArray1::from_vec(py, channel.values).reshape(shape)?;
            image.set_item(channel.name, frozen(&values)?)?;
        }
        frozen(&x_m)?;
        frozen(&y_m)?;
        let corner_m = [raster.x_min_m, raster.y_min_m];
        Ok(View {
            image: image.unbind(),
            cloud: cloud.unbind(),
            x_m: x_m.unbind(),
            y_m: y_m.unbind(),
            corner_m,
            pixel_m: raster.pixel_m,
            threshold_w,
        })
    }

    /// The cloud as numbers, with the names that its file has.
    fn table(&self, py: Python<'_>) -> PyResult<Table> {
        let columns = self.cloud.bind(py).iter().map(|(name, values)| {
            let values = values.call_method1("astype", ("float64",))?;
            let values = values.cast_into::<PyArray1<f64>>().map_err(PyErr::from)?.to_vec()?;
            let name: String = name.extract()?;
            Ok(Column { name: without_unit(&name).to_owned(), scalar: Scalar::Double, values })
        });
        Ok(Table { comments: Vec::new(), columns: columns.collect::<PyResult<_>>()? })
    }

    /// The power image.
    fn raster(&self, py: Python<'_>) -> PyResult<Raster> {
        let [x_min_m, y_min_m] = self.corner_m;
        let power = self.channel(py, "power_dbm")?.cast_into::<PyArray2<f32>>()?;
        let channel = Channel { name: "power_dbm".to_owned(), values: power.to_vec()? };
        let &[height, width] = power.shape() else {
            return Err(PyValueError::new_err("an image has rows and columns"));
        };
        let pixel_m = self.pixel_m;
        Ok(Raster { width, height, x_min_m, y_min_m, pixel_m, channels: vec![channel] })
    }

    fn channel<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.image.bind(py).as_any().get_item(name)
    }

    fn column<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.cloud.bind(py).as_any().get_item(name)
    }
}

/// Columns of a cloud's file, as the PLY of others has them, and the same with their units.
const PLACES: [(&str, &str); 3] = [("x", "x_m"), ("y", "y_m"), ("z", "z_m")];

fn with_unit(name: &str) -> &str {
    PLACES.iter().find(|(bare, _)| *bare == name).map_or(name, |(_, known)| known)
}

fn without_unit(name: &str) -> &str {
    PLACES.iter().find(|(_, known)| *known == name).map_or(name, |(bare, _)| bare)
}

/// The detections of a view with every column.
fn table(ready: &ReadyScene, view: &Received<'_>, materials: &[String]) -> Table {
    let regions: Vec<&str> =
        ready.scene.target.regions.iter().map(|region| region.name.as_str()).collect();
    let materials: Vec<&str> = materials.iter().map(String::as_str).collect();
    let detections: Vec<&Echo> = view.scan.detections().collect();
    cloud_table(&detections, &ready.material_of_region, &regions, &materials, true)
}

/// An array that nobody may write: it is shared.
fn frozen<'a, 'py, T>(array: &'a Bound<'py, T>) -> PyResult<&'a Bound<'py, T>> {
    array.as_any().call_method1("setflags", (false,))?;
    Ok(array)
}

/// A column with the type that the cloud's file has.
fn array<'py>(py: Python<'py>, column: Column) -> PyResult<Bound<'py, PyAny>> {
    let values = column.values;
    Ok(match column.scalar {
        Scalar::Double => PyArray1::from_vec(py, values).into_any(),
        Scalar::Float => PyArray1::from_iter(py, values.iter().map(|one| *one as f32)).into_any(),
        Scalar::UInt => PyArray1::from_iter(py, values.iter().map(|one| *one as u32)).into_any(),
        _ => PyArray1::from_iter(py, values.iter().map(|one| *one as i32)).into_any(),
    })
}

#[pymethods]
impl View {
    /// The image's channels by name: float32 arrays (rows, columns), NaN where nothing was detected.
    #[getter]
    fn image<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.image.bind(py).copy()
    }

    /// Received power, dBm: float32 (rows, columns), row 0 at the top, NaN where nothing was detected.
    #[getter]
    fn power_dbm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.channel(py, "power_dbm")
    }

    /// Range, m, as `power_dbm`.
    #[getter]
    fn range_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.channel(py, "range_m")
    }

    /// Places of the image's columns, x of the target plane, m.
    #[getter]
    fn x_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.x_m.bind(py).clone()
    }

    /// Places of the image's rows, y of the target plane, m; row 0 is the largest.
    #[getter]
    fn y_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.y_m.bind(py).clone()
    }

    /// The detections: a column each of the measured values and of what truly caused them, by name with unit.
    #[getter]
    fn cloud(&self, py: Python<'_>) -> table::Table {
        table::Table::new(self.cloud.clone_ref(py))
    }

    /// Places of the detections in the global frame, m: float64 (n, 3).
    #[getter]
    fn xyz_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let columns = PLACES.map(|(_, name)| self.column(py, name));
        let [x, y, z] = columns;
        py.import("numpy")?.call_method1("column_stack", ((x?, y?, z?),))
    }

    /// Received power of the detections, dBm: float32 (n,).
    #[getter]
    fn points_dbm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.column(py, "power_dbm")
    }

    /// Least power that counts as a detection, W.
    #[getter]
    fn threshold_w(&self) -> f64 {
        self.threshold_w
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.column(py, "x_m")?.len()
    }

    /// A view of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(
        image: Py<PyDict>,
        cloud: Py<PyDict>,
        axes: (Py<PyArray1<f64>>, Py<PyArray1<f64>>),
        corner_m: [f64; 2],
        pixel_m: f64,
        threshold_w: f64,
    ) -> View {
        let (x_m, y_m) = axes;
        View { image, cloud, x_m, y_m, corner_m, pixel_m, threshold_w }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let View { image, cloud, x_m, y_m, corner_m, pixel_m, threshold_w } = slf.get();
        let parts = (image, cloud, (x_m, y_m), *corner_m, *pixel_m, *threshold_w);
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(slf.py())
    }
}

#[pymethods]
impl Scan {
    /// Name of the scene.
    #[getter]
    fn name(&self) -> &str {
        self.scene.get().name()
    }

    /// The scene, with the seed of this rendering.
    #[getter]
    fn scene(&self) -> &Py<Scene> {
        &self.scene
    }

    /// What each antenna received, by its name: `radar` is the radar's own, `cross-radar` its cross-polar channel,
    /// `radar-NAME` a receiver.
    #[getter]
    fn views<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let views = PyDict::new(py);
        for (name, view) in &self.views {
            views.set_item(name, view)?;
        }
        Ok(views)
    }

    /// Received power, dBm: float32 (rows, columns), row 0 at the top, NaN where nothing was detected.
    #[getter]
    fn power_dbm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.radar(py)?.get().power_dbm(py)
    }

    /// Range, m, as `power_dbm`.
    #[getter]
    fn range_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.radar(py)?.get().range_m(py)
    }

    /// Places of the image's columns, x of the target plane, m.
    #[getter]
    fn x_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.radar(py)?.get().x_m(py))
    }

    /// Places of the image's rows, y of the target plane, m; row 0 is the largest.
    #[getter]
    fn y_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(self.radar(py)?.get().y_m(py))
    }

    /// The detections of the radar's own view, as `View.cloud`.
    #[getter]
    fn cloud(&self, py: Python<'_>) -> PyResult<table::Table> {
        Ok(self.radar(py)?.get().cloud(py))
    }

    /// Places of the detections in the global frame, m: float64 (n, 3).
    #[getter]
    fn xyz_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.radar(py)?.get().xyz_m(py)
    }

    /// Received power of the detections, dBm: float32 (n,).
    #[getter]
    fn points_dbm<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.radar(py)?.get().points_dbm(py)
    }

    /// What a person should not overlook, a sentence each.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.iter().map(|notice| in_python(notice)).collect()
    }

    /// What was rendered and of what, as `scan.json` has it.
    #[getter]
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("json")?.call_method1("loads", (self.file(py, "scan.json")?,))
    }

    /// Names of its files.
    #[getter]
    fn file_names(&self) -> Vec<&str> {
        self.files.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Bytes of one of its files.
    fn file<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyBytes>> {
        let found = self.files.iter().find(|(own, _)| own == name);
        let (_, bytes) = found.ok_or_else(|| PyKeyError::new_err(name.to_owned()))?;
        Ok(PyBytes::new(py, bytes))
    }

    /// Writes the files that `matdb render` writes, all or none.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| write_all(&folder, &self.files)).map_err(raised)
    }

    /// The detections in three dimensions, with target, radar and image, as a page. A notebook shows it.
    ///
    /// Parameters
    /// ----------
    /// view : str, default "radar"
    ///     Name of one of `views`.
    #[pyo3(signature = (*, view = "radar"))]
    fn show(&self, py: Python<'_>, view: &str) -> PyResult<Page> {
        let view = self.view(view)?;
        let (cloud, image) = (view.get().table(py)?, view.get().raster(py)?);
        let materials: Vec<&str> = self.materials.iter().map(String::as_str).collect();
        let scene = self.scene.get().scene();
        let bytes = py.detach(|| rendering_page(scene, &cloud, &image, &materials));
        Ok(Page { html: String::from_utf8(bytes.map_err(raised)?)? })
    }

    /// The detections and the target as the bytes of a `.glb` file, which Blender, three.js and trimesh read.
    ///
    /// Parameters
    /// ----------
    /// view : str, default "radar"
    ///     Name of one of `views`.
    #[pyo3(signature = (*, view = "radar"))]
    fn glb<'py>(&self, py: Python<'py>, view: &str) -> PyResult<Bound<'py, PyBytes>> {
        let cloud = self.view(view)?.get().table(py)?;
        let scene = self.scene.get().scene();
        let bytes = py.detach(|| rendering_glb(scene, &cloud)).map_err(raised)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// The power image, on axes of matplotlib.
    #[pyo3(signature = (ax = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        ax: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._plots")?.call_method1("scan", (slf, ax))
    }

    /// The detections as a point cloud of Open3D, coloured by power, with `power_dbm`, `range_m` and `chirp` as attributes.
    ///
    /// Returns
    /// -------
    /// open3d.t.geometry.PointCloud
    fn to_open3d<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("matdb._extras")?.call_method1("to_open3d", (slf,))
    }

    /// Logs detections, coloured by power, and image to the recording of rerun that is open.
    ///
    /// Parameters
    /// ----------
    /// entity : str, default "matdb"
    ///     Path of the entity that gets `points` and `power_dbm`.
    #[pyo3(signature = (entity = "matdb"))]
    fn to_rerun(slf: &Bound<'_, Self>, entity: &str) -> PyResult<()> {
        slf.py().import("matdb._extras")?.call_method1("to_rerun", (slf, entity)).map(|_| ())
    }

    /// The picture, for a notebook.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.file(py, "power.png")
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let detections = self.radar(py)?.get().__len__(py)?;
        let chirps = self.scene.get().chirps();
        Ok(format!("<matdb.Scan {}: {detections} detections of {chirps} chirps>", self.name()))
    }

    /// A scan of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(
        scene: Py<Scene>,
        files: Vec<(String, Bound<'_, PyBytes>)>,
        views: Vec<(String, Py<View>)>,
        notices: Vec<String>,
        materials: Vec<String>,
    ) -> Scan {
        let files = files.into_iter().map(|(name, bytes)| (name, bytes.as_bytes().to_vec()));
        Scan { scene, files: files.collect(), views, notices, materials }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, Scan { scene, files, views, notices, materials }) = (slf.py(), slf.get());
        let files = files.iter().map(|(name, bytes)| (name, PyBytes::new(py, bytes)));
        let views = views.iter().map(|(name, view)| (name, view));
        let parts = (scene, Vec::from_iter(files), Vec::from_iter(views), notices, materials);
        (slf.get_type().getattr("_of_parts")?, parts).into_pyobject(py)
    }
}

#[pymethods]
impl Page {
    /// The whole page.
    #[getter]
    fn html(&self) -> &str {
        &self.html
    }

    /// Writes the page to a file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        py.detach(|| write_all(folder_of(&path), &[(name, self.html.clone().into_bytes())]))
            .map_err(raised)
    }

    /// The page in a frame, for a notebook.
    fn _repr_html_(&self) -> String {
        let page = self.html.replace('&', "&amp;").replace('"', "&quot;");
        format!(
            "<iframe srcdoc=\"{page}\" width=\"100%\" height=\"640\" style=\"border:0\"></iframe>"
        )
    }

    fn __repr__(&self) -> String {
        format!(
            "<matdb.Page of {} kB: a notebook shows it, save(path) writes it>",
            self.html.len() / 1000
        )
    }
}
