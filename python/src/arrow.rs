//! Tables for other programs, by the Arrow C stream interface: a stream of one batch whose columns are numbers. The layout of
//! the structures is that of <https://arrow.apache.org/docs/format/CDataInterface.html>.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::ptr::{null, null_mut};

use pyo3::prelude::*;
use pyo3::types::PyCapsule;

/// Numbers under a name. One that is not there is null.
pub(crate) struct Column {
    name: String,
    format: &'static CStr,
    /// The bytes of the numbers, where any number may begin.
    bytes: Vec<u64>,
    /// A bit for each number that is there; none where all are.
    valid: Option<Vec<u8>>,
    length: usize,
    nulls: usize,
}

impl Column {
    /// Numbers in double precision. NaN is null.
    pub(crate) fn of_f64(name: &str, values: impl IntoIterator<Item = f64>) -> Column {
        let values = values.into_iter().map(|one| (!one.is_nan(), one.to_ne_bytes()));
        Column::new(name, c"g", values)
    }

    /// Numbers in single precision. NaN is null.
    pub(crate) fn of_f32(name: &str, values: impl IntoIterator<Item = f32>) -> Column {
        let values = values.into_iter().map(|one| (!one.is_nan(), one.to_ne_bytes()));
        Column::new(name, c"f", values)
    }

    /// Whole numbers.
    pub(crate) fn of_i32(name: &str, values: impl IntoIterator<Item = i32>) -> Column {
        Column::new(name, c"i", values.into_iter().map(|one| (true, one.to_ne_bytes())))
    }

    /// Whole numbers from 0 on, some of which are not there.
    pub(crate) fn of_u32(name: &str, values: impl IntoIterator<Item = Option<u32>>) -> Column {
        let values = values.into_iter();
        let values = values.map(|one| (one.is_some(), one.unwrap_or_default().to_ne_bytes()));
        Column::new(name, c"I", values)
    }

    fn new<const N: usize>(
        name: &str,
        format: &'static CStr,
        values: impl Iterator<Item = (bool, [u8; N])>,
    ) -> Column {
        let (mut bytes, mut valid, mut length, mut nulls) = (Vec::new(), Vec::new(), 0, 0);
        for (is_there, value) in values {
            bytes.extend(value);
            if length % 8 == 0 {
                valid.push(0);
            }
            if is_there {
                valid[length / 8] |= 1 << (length % 8);
            } else {
                nulls += 1;
            }
            length += 1;
        }
        let valid = (nulls > 0).then_some(valid);
        let bytes = aligned(&bytes);
        Column { name: name.to_owned(), format, bytes, valid, length, nulls }
    }
}

/// Bytes at an address that eight divides.
fn aligned(bytes: &[u8]) -> Vec<u64> {
    let eights = bytes.chunks(8).map(|chunk| {
        let mut eight = [0; 8];
        eight[..chunk.len()].copy_from_slice(chunk);
        u64::from_ne_bytes(eight)
    });
    eights.collect()
}

/// The columns as the capsule that `__arrow_c_stream__` returns.
pub(crate) fn stream<'py>(
    py: Python<'py>,
    columns: Vec<Column>,
) -> PyResult<Bound<'py, PyCapsule>> {
    let stream = Stream {
        get_schema: Some(get_schema),
        get_next: Some(get_next),
        get_last_error: Some(get_last_error),
        release: Some(release_stream),
        private_data: Box::into_raw(Box::new(Source { columns, is_read: false })).cast(),
    };
    PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
}

/// `struct ArrowArrayStream`.
#[repr(C)]
struct Stream {
    get_schema: Option<unsafe extern "C" fn(*mut Stream, *mut Schema) -> c_int>,
    get_next: Option<unsafe extern "C" fn(*mut Stream, *mut Array) -> c_int>,
    get_last_error: Option<unsafe extern "C" fn(*mut Stream) -> *const c_char>,
    release: Option<unsafe extern "C" fn(*mut Stream)>,
    private_data: *mut c_void,
}

/// What a stream gives: its columns, once.
struct Source {
    columns: Vec<Column>,
    is_read: bool,
}

/// `struct ArrowSchema`.
#[repr(C)]
struct Schema {
    format: *const c_char,
    name: *const c_char,
    metadata: *const c_char,
    flags: i64,
    n_children: i64,
    children: *mut *mut Schema,
    dictionary: *mut Schema,
    release: Option<unsafe extern "C" fn(*mut Schema)>,
    private_data: *mut c_void,
}

/// What a schema points to.
struct SchemaParts {
    _name: CString,
    children: Vec<*mut Schema>,
}

/// `struct ArrowArray`.
#[repr(C)]
struct Array {
    length: i64,
    null_count: i64,
    offset: i64,
    n_buffers: i64,
    n_children: i64,
    buffers: *mut *const c_void,
    children: *mut *mut Array,
    dictionary: *mut Array,
    release: Option<unsafe extern "C" fn(*mut Array)>,
    private_data: *mut c_void,
}

/// What an array points to.
struct ArrayParts {
    _column: Option<Column>,
    buffers: Vec<*const c_void>,
    children: Vec<*mut Array>,
}

/// A value may be null.
const NULLABLE: i64 = 2;

impl Schema {
    fn new(name: &str, format: &'static CStr, flags: i64, children: Vec<Schema>) -> Schema {
        let children = children.into_iter().map(|one| Box::into_raw(Box::new(one))).collect();
        // No name of ours has a NUL.
        let name = CString::new(name).unwrap_or_default();
        let text = name.as_ptr();
        let mut parts = Box::new(SchemaParts { _name: name, children });
        Schema {
            format: format.as_ptr(),
            name: text,
            metadata: null(),
            flags,
            n_children: parts.children.len() as i64,
            children: parts.children.as_mut_ptr(),
            dictionary: null_mut(),
            release: Some(release_schema),
            private_data: Box::into_raw(parts).cast(),
        }
    }
}

impl Array {
    fn new(column: Column) -> Array {
        let valid = column.valid.as_ref().map_or(null(), |valid| valid.as_ptr().cast());
        let buffers = vec![valid, column.bytes.as_ptr().cast()];
        let (length, nulls) = (column.length, column.nulls);
        Array::of_parts([length, nulls], Some(column), buffers, Vec::new())
    }

    /// A row of columns.
    fn of_columns(columns: Vec<Column>) -> Array {
        let length = columns.first().map_or(0, |column| column.length);
        let children = columns.into_iter().map(|one| Box::into_raw(Box::new(Array::new(one))));
        let children = children.collect();
        Array::of_parts([length, 0], None, vec![null()], children)
    }

    fn of_parts(
        [length, nulls]: [usize; 2],
        column: Option<Column>,
        buffers: Vec<*const c_void>,
        children: Vec<*mut Array>,
    ) -> Array {
        let mut parts = Box::new(ArrayParts { _column: column, buffers, children });
        Array {
            length: length as i64,
            null_count: nulls as i64,
            offset: 0,
            n_buffers: parts.buffers.len() as i64,
            n_children: parts.children.len() as i64,
            buffers: parts.buffers.as_mut_ptr(),
            children: parts.children.as_mut_ptr(),
            dictionary: null_mut(),
            release: Some(release_array),
            private_data: Box::into_raw(parts).cast(),
        }
    }

    /// The end of a stream.
    fn end() -> Array {
        Array {
            length: 0,
            null_count: 0,
            offset: 0,
            n_buffers: 0,
            n_children: 0,
            buffers: null_mut(),
            children: null_mut(),
            dictionary: null_mut(),
            release: None,
            private_data: null_mut(),
        }
    }
}

// SAFETY: whoever has a stream has all that it points to, and nothing of it belongs to a thread.
unsafe impl Send for Stream {}

impl Drop for Stream {
    fn drop(&mut self) {
        if let Some(release) = self.release {
            // SAFETY: it has not been released, and its parts are those that `stream` made.
            unsafe { release(self) }
        }
    }
}

// SAFETY of what follows: the interface promises that each is called with structures that are ours and not released, and
// with room for what is written.

unsafe extern "C" fn get_schema(stream: *mut Stream, schema: *mut Schema) -> c_int {
    let source = unsafe { &*(*stream).private_data.cast::<Source>() };
    let columns = source.columns.iter();
    let children =
        columns.map(|column| Schema::new(&column.name, column.format, NULLABLE, Vec::new()));
    unsafe { schema.write(Schema::new("", c"+s", 0, children.collect())) };
    0
}

unsafe extern "C" fn get_next(stream: *mut Stream, array: *mut Array) -> c_int {
    let source = unsafe { &mut *(*stream).private_data.cast::<Source>() };
    let next = if source.is_read {
        Array::end()
    } else {
        source.is_read = true;
        let taken = source.columns.iter_mut().map(Column::take);
        Array::of_columns(taken.collect())
    };
    unsafe { array.write(next) };
    0
}

unsafe extern "C" fn get_last_error(_: *mut Stream) -> *const c_char {
    null()
}

unsafe extern "C" fn release_stream(stream: *mut Stream) {
    unsafe {
        drop(Box::from_raw((*stream).private_data.cast::<Source>()));
        (*stream).release = None;
    }
}

unsafe extern "C" fn release_schema(schema: *mut Schema) {
    unsafe {
        let parts = Box::from_raw((*schema).private_data.cast::<SchemaParts>());
        for child in parts.children {
            let mut child = Box::from_raw(child);
            // Whoever moved a child out of here releases it.
            if let Some(release) = child.release {
                release(&mut *child);
            }
        }
        (*schema).release = None;
    }
}

unsafe extern "C" fn release_array(array: *mut Array) {
    unsafe {
        let parts = Box::from_raw((*array).private_data.cast::<ArrayParts>());
        for child in parts.children {
            let mut child = Box::from_raw(child);
            if let Some(release) = child.release {
                release(&mut *child);
            }
        }
        (*array).release = None;
    }
}

impl Column {
    /// The numbers, of which only name and form stay here: a schema may still be asked for.
    fn take(&mut self) -> Column {
        let left = Column {
            name: self.name.clone(),
            format: self.format,
            bytes: Vec::new(),
            valid: None,
            length: 0,
            nulls: 0,
        };
        std::mem::replace(self, left)
    }
}
