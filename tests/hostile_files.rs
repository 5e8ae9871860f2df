//! No sequence of bytes makes a reader panic or allocate more than a small multiple of its input.
//!
//! Valid files are damaged at random, files are built to be as greedy as their format allows, and a
//! counting allocator watches over both.

#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use matdb::formats::ply::{Column, Scalar, Table, read_table, write_table};
use matdb::formats::{FormatError, MeshFormat};
use matdb::geometry::mesh::MeshError;
use proptest::prelude::*;
use proptest::sample::Index;

/// What a reader may hold at once, per byte of input. The costliest byte is a polygon's corner: a
/// facet of 12 bytes and two labels of 4, each in a vector that may be twice as large as it is full
/// and is copied to grow.
const MOST_BYTES_PER_BYTE: usize = 64;
/// What a reader may hold at once however small the input: hash tables, error texts.
const MOST_BYTES_ANYWAY: usize = 16 * 1024;

/// The system's allocator, counting what each thread holds.
struct Counting;

thread_local! {
    static HELD_BYTES: Cell<isize> = const { Cell::new(0) };
    static PEAK_BYTES: Cell<isize> = const { Cell::new(0) };
}

fn count(bytes: isize) {
    let held = HELD_BYTES.get() + bytes;
    HELD_BYTES.set(held);
    PEAK_BYTES.set(PEAK_BYTES.get().max(held));
}

// SAFETY: every call goes to the system's allocator unchanged; growing takes the default way over
// `alloc` and `dealloc`, so that the copy is counted.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as isize));
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs a reader and checks its greatest use of memory, results included.
fn frugally<T>(bytes: &[u8], read: impl Fn(&[u8]) -> T) -> T {
    let before = HELD_BYTES.get();
    PEAK_BYTES.set(before);
    let result = read(bytes);
    let used_bytes = (PEAK_BYTES.get() - before) as usize;
    let allowed_bytes = MOST_BYTES_PER_BYTE * bytes.len() + MOST_BYTES_ANYWAY;
    assert!(used_bytes <= allowed_bytes, "{} bytes of input took {used_bytes}", bytes.len());
    result
}

/// Reads as everything; whatever is read must be consistent.
fn read_all(bytes: &[u8]) {
    for format in [MeshFormat::Ply, MeshFormat::Obj, MeshFormat::Stl] {
        let Ok(mesh) = frugally(bytes, |bytes| format.read(bytes)) else { continue };
        for labels in &mesh.labels {
            assert_eq!(labels.name_of_facet.len(), mesh.facets.len());
            assert!(labels.name_of_facet.iter().all(|&n| (n as usize) < labels.names.len()));
        }
    }
    if let Ok(table) = frugally(bytes, read_table) {
        assert!(table.columns.iter().all(|c| c.values.len() == table.rows()));
        write_table(&table).expect("a table that was read can be written");
    }
}

fn ply(encoding: &str, elements: &str, body: &[u8]) -> Vec<u8> {
    [format!("ply\nformat {encoding} 1.0\n{elements}end_header\n").as_bytes(), body].concat()
}

const SQUARE_ELEMENTS: &str = "comment a square\nelement vertex 4\nproperty float x\n\
    property float y\nproperty float z\nproperty uchar red\nelement face 2\n\
    property list uchar int vertex_indices\nproperty short part\n\
    property list uchar float texcoord\n";

fn binary_ply(big_endian: bool) -> Vec<u8> {
    let mut body = Vec::new();
    let mut put = |little: &[u8]| {
        let in_order = little.iter().copied();
        if big_endian { body.extend(in_order.rev()) } else { body.extend(in_order) }
    };
    for corner in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]] {
        corner.iter().for_each(|x| put(&x.to_le_bytes()));
        put(&[200]);
    }
    for face in [&[0i32, 1, 2, 3] as &[i32], &[0, 2, 3]] {
        put(&[face.len() as u8]);
        face.iter().for_each(|i| put(&i.to_le_bytes()));
        put(&7i16.to_le_bytes());
        put(&[1]);
        put(&0.25f32.to_le_bytes());
    }
    let encoding = if big_endian { "binary_big_endian" } else { "binary_little_endian" };
    ply(encoding, SQUARE_ELEMENTS, &body)
}

fn ascii_ply() -> Vec<u8> {
    let body = b"0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0.5 9\n4 0 1 2 3 7 1 0.25\n3 0 2 3 8 0\n";
    ply("ascii", SQUARE_ELEMENTS, body)
}

fn table_ply() -> Vec<u8> {
    let column = |name: &str, scalar| Column {
        name: name.to_owned(),
        scalar,
        values: (0..9).map(f64::from).collect(),
    };
    let columns = vec![column("range_m", Scalar::Double), column("facet", Scalar::UInt)];
    write_table(&Table { comments: vec!["seed 1".to_owned()], columns }).unwrap()
}

const OBJ: &str = "mtllib a.mtl\no body\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
    usemtl skin\nf 1/1/1 2/1/1 3/1/1 4/1/1\ng arm\nf -1//1 -2//1 \\\n-3//1\r\n";

const STL: &str = "solid plate\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
    vertex 1 1e0 0\nendloop\nendfacet\nendsolid plate\nsolid b\nendsolid b\n";

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend(3u32.to_le_bytes());
    bytes.extend((0..150).map(|i| i % 64));
    bytes
}

fn samples() -> [Vec<u8>; 7] {
    let (obj, stl) = (OBJ.into(), STL.into());
    [binary_ply(false), binary_ply(true), ascii_ply(), table_ply(), obj, stl, binary_stl()]
}

#[test]
fn the_samples_are_valid() {
    for (sample, format, facets) in [
        (binary_ply(false), MeshFormat::Ply, 3),
        (binary_ply(true), MeshFormat::Ply, 3),
        (ascii_ply(), MeshFormat::Ply, 3),
        (OBJ.into(), MeshFormat::Obj, 3),
        (STL.into(), MeshFormat::Stl, 1),
        (binary_stl(), MeshFormat::Stl, 3),
    ] {
        assert_eq!(format.read(&sample).unwrap().facets.len(), facets);
    }
    assert_eq!(read_table(&table_ply()).unwrap().rows(), 9);
}

/// One way to damage a file.
#[derive(Clone, Debug)]
enum Damage {
    FlipBit(Index, u8),
    Truncate(Index),
    /// Copies some bytes from one place over another.
    Splice(Index, Index, usize),
    /// Replaces one of the numbers that are written as text.
    Number(Index, &'static str),
    Insert(Index, Vec<u8>),
}

fn damage() -> impl Strategy<Value = Damage> {
    const NUMBERS: [&str; 10] = [
        "0",
        "-1",
        "255",
        "65536",
        "4294967295",
        "1000000000000",
        "18446744073709551615",
        "1e308",
        "nan",
        "",
    ];
    let at = any::<Index>;
    prop_oneof![
        (at(), 0..8u8).prop_map(|(at, bit)| Damage::FlipBit(at, bit)),
        at().prop_map(Damage::Truncate),
        (at(), at(), 1..40usize).prop_map(|(from, to, len)| Damage::Splice(from, to, len)),
        (at(), prop::sample::select(&NUMBERS[..])).prop_map(|(at, n)| Damage::Number(at, n)),
        (at(), prop::collection::vec(any::<u8>(), 1..9)).prop_map(|(at, b)| Damage::Insert(at, b)),
    ]
}

fn apply(damage: &Damage, bytes: &mut Vec<u8>) {
    let size = bytes.len();
    match damage {
        _ if size == 0 => {}
        Damage::FlipBit(at, bit) => bytes[at.index(size)] ^= 1 << bit,
        Damage::Truncate(at) => bytes.truncate(at.index(size)),
        Damage::Splice(from, to, len) => {
            let (from, to) = (from.index(size), to.index(size));
            let piece = bytes[from..size.min(from + len)].to_vec();
            bytes.splice(to..size.min(to + len), piece);
        }
        Damage::Number(at, number) => {
            let starts: Vec<usize> = (1..size)
                .filter(|&i| bytes[i].is_ascii_digit() && !bytes[i - 1].is_ascii_digit())
                .collect();
            if !starts.is_empty() {
                let start = starts[at.index(starts.len())];
                let digits = bytes[start..].iter().take_while(|b| b.is_ascii_digit()).count();
                bytes.splice(start..start + digits, number.bytes());
            }
        }
        Damage::Insert(at, piece) => {
            let at = at.index(size);
            bytes.splice(at..at, piece.iter().copied());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 4000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn damaged_files_are_read_or_refused(
        sample in any::<Index>(),
        damages in prop::collection::vec(damage(), 1..6),
    ) {
        let mut bytes = samples()[sample.index(samples().len())].clone();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        read_all(&bytes);
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        read_all(&bytes);
    }
}

#[test]
fn every_truncation_is_read_or_refused() {
    for sample in samples() {
        (0..sample.len()).for_each(|end| read_all(&sample[..end]));
    }
}

/// Files that make as much as they can out of each byte.
#[test]
fn greedy_files_stay_frugal() {
    const SIZE_BYTES: usize = 200_000;
    let repeated = |text: &str| text.repeat(SIZE_BYTES / text.len());
    let numbered = |text: &str| -> String {
        (0..SIZE_BYTES / text.len()).map(|i| text.replace('#', &i.to_string())).collect()
    };
    let vertex = "element vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n";
    let polygon = |labels: usize| {
        let labels: String = (0..labels).map(|i| format!("property uchar l{i}\n")).collect();
        let face = format!("element face 1\nproperty list uint uchar vertex_index\n{labels}");
        let corners = (SIZE_BYTES as u32).to_le_bytes();
        let body = [&[0; 3], corners.as_slice(), &[0; SIZE_BYTES], &[5; 1000]].concat();
        ply("binary_little_endian", &format!("{vertex}{face}"), &body)
    };
    let distinct = |width: u32, labels: usize| {
        let labels: String = (0..labels).map(|i| format!("property uint l{i}\n")).collect();
        let faces = SIZE_BYTES as u32 / width;
        let face =
            format!("element face {faces}\nproperty list uchar uchar vertex_index\n{labels}");
        let row =
            |i: u32| [&[3, 0, 0, 0], i.to_le_bytes().repeat(width as usize).as_slice()].concat();
        let body = [vec![0; 3], (0..faces).flat_map(row).collect()].concat();
        ply("binary_little_endian", &format!("{vertex}{face}"), &body)
    };
    let strip = |labels: usize| {
        let labels: String = (0..labels).map(|i| format!("property int l{i}\n")).collect();
        let vertex = vertex.replace("vertex 1", "vertex 3");
        let list = "property list uint uchar vertex_indices\n";
        let elements = format!("{vertex}element face 0\n{list}{labels}element tristrips 1\n{list}");
        let corners: Vec<u8> = [0, 1, 2].repeat(SIZE_BYTES / 3);
        let count = (corners.len() as u32).to_le_bytes();
        let body = [&[0; 9], count.as_slice(), corners.as_slice()].concat();
        ply("binary_little_endian", &elements, &body)
    };
    let header = |elements: &str| ply("ascii", elements, b"");
    let files = [
        polygon(0),
        polygon(1),
        polygon(2),
        polygon(1000),
        strip(0),
        strip(1),
        strip(1000),
        distinct(1, 1),
        distinct(8, 8),
        header(&repeated("comment\n")),
        header(&numbered("element e# 0\n")),
        header(&format!("element e 0\n{}", numbered("property int p#\n"))),
        header(&format!("element vertex 0\n{}", numbered("property list int int p#\n"))),
        header(&format!("comment {}\n", repeated("x"))),
        header(&repeated("\u{1}")),
        ply("ascii", vertex, repeated("9").as_bytes()),
        format!("v 0 0 0\nf{}", repeated(" 1")).into_bytes(),
        format!("v 0 0 0\n{}", numbered("g #\nf 1 1 1\n")).into_bytes(),
        format!("v 0 0 0\n{}", numbered("g #\nusemtl #\nf 1 1 1\n")).into_bytes(),
        repeated("v 0 0 0\n").into_bytes(),
        repeated("\\\n").into_bytes(),
        repeated("f").into_bytes(),
        vec![0xff; SIZE_BYTES],
        format!("solid\n{}", numbered("vertex # 0 0\n")).into_bytes(),
        format!("solid\n{}", repeated("x ")).into_bytes(),
        numbered("solid #\nendloop\n").into_bytes(),
    ];
    files.iter().for_each(|file| read_all(file));
}

fn problem(format: MeshFormat, bytes: &[u8]) -> String {
    frugally(bytes, |bytes| format.read(bytes)).unwrap_err().to_string()
}

#[test]
fn impossible_counts_are_refused() {
    let ascii = String::from_utf8(ascii_ply()).unwrap();
    for (what, instead) in [
        ("vertex 4", "vertex 1000000000000"),
        ("face 2", "face 18446744073709551615"),
        ("element face", "element nothing 4000000000\nelement face"),
    ] {
        let text = ascii.replace(what, instead);
        assert!(problem(MeshFormat::Ply, text.as_bytes()).starts_with("header: "), "{instead}");
        assert!(frugally(text.as_bytes(), read_table).is_err(), "{instead}");
    }
    let mut stl = binary_stl();
    stl[80..84].fill(0xff);
    assert!(problem(MeshFormat::Stl, &stl).starts_with("byte 80: 4294967295 facets"));
}

#[test]
fn truncated_bodies_are_refused() {
    for (format, file) in [
        (MeshFormat::Ply, binary_ply(false)),
        (MeshFormat::Ply, binary_ply(true)),
        (MeshFormat::Stl, binary_stl()),
    ] {
        assert!(problem(format, &file[..file.len() - 1]).starts_with("byte "));
    }
    let cut = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n";
    assert!(problem(MeshFormat::Stl, cut.as_bytes()).starts_with("line 4: the file ends"));
}

#[test]
fn indices_out_of_range_are_refused() {
    let ascii = String::from_utf8(ascii_ply()).unwrap();
    for index in ["4", "-1", "2147483647"] {
        let text = ascii.replace("3 0 2 3", &format!("3 0 2 {index}"));
        assert!(problem(MeshFormat::Ply, text.as_bytes()).starts_with("face 1: refers to vertex"));
    }
    for index in ["0", "5", "-5", "9223372036854775807", "-9223372036854775808"] {
        let text = format!("{OBJ}f 1 2 {index}\n");
        assert!(problem(MeshFormat::Obj, text.as_bytes()).starts_with("line 14: "), "{index}");
    }
}

#[test]
fn vertices_that_are_not_finite_are_refused() {
    let stl = [&STL.replace("1e0", "inf"), "solid c\nendsolid c\n"].concat();
    let ply = String::from_utf8(ascii_ply()).unwrap().replace("0.5 9", "nan 9");
    for (format, text) in [
        (MeshFormat::Ply, ply.as_str()),
        (MeshFormat::Obj, "v 0 NaN 0\nf 1 1 1\n"),
        (MeshFormat::Stl, &stl),
    ] {
        let error = format.read(text.as_bytes()).unwrap_err();
        assert!(matches!(error, FormatError::Mesh(MeshError::NotFinite { .. })), "{error}");
    }
}

#[test]
fn files_without_faces_are_refused() {
    let no_faces = FormatError::Mesh(MeshError::NoFacets);
    assert_eq!(MeshFormat::Ply.read(&table_with_points()).unwrap_err(), no_faces);
    assert_eq!(MeshFormat::Obj.read(b"v 0 0 0\n").unwrap_err(), no_faces);
    assert_eq!(MeshFormat::Stl.read(b"solid a\nendsolid a\n").unwrap_err(), no_faces);
    assert_eq!(MeshFormat::Stl.read(&[0; 84]).unwrap_err(), no_faces);
}

fn table_with_points() -> Vec<u8> {
    let column = |name: &str| Column {
        name: name.to_owned(),
        scalar: Scalar::Float,
        values: vec![0.0, 1.0],
    };
    let columns = ["x", "y", "z"].map(column).into();
    write_table(&Table { comments: Vec::new(), columns }).unwrap()
}

#[test]
fn empty_files_are_refused() {
    assert!(problem(MeshFormat::Ply, b"").starts_with("byte 0: this is not a PLY file"));
    assert_eq!(MeshFormat::Obj.read(b""), Err(FormatError::Mesh(MeshError::NoFacets)));
    assert!(problem(MeshFormat::Stl, b"").starts_with("byte 0: this is not an STL file"));
    assert!(read_table(b"").is_err());
}
