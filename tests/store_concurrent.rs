//! Several threads and several programs may make, fill and read one database at once.

use std::path::Path;

use crate::support::database::{child, contents, given, is_sound, sample};
use matdb::material::builtin;
use matdb::store::{Addition, Filter, Store};

const WRITERS: usize = 4;
const MATERIALS: usize = 5;

fn write(path: &Path, writer: usize) {
    let mut store = Store::open(path).unwrap();
    for number in 0..MATERIALS {
        let material = sample(&format!("of-{writer}-{number}"));
        assert_eq!(store.add([&material]).unwrap(), [Addition::New]);
        assert_eq!(store.get(&material.slug, None).unwrap().unwrap().material, material);
    }
}

fn check(path: &Path) {
    assert_eq!(contents(path).len(), WRITERS * MATERIALS);
    assert!(is_sound(path));
}

#[test]
fn threads_write_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for round in 0..10 {
        let path = folder.path().join(format!("{round}.sqlite"));
        std::thread::scope(|scope| {
            for writer in 0..WRITERS {
                let path = &path;
                scope.spawn(move || write(path, writer));
            }
        });
        check(&path);
    }
}

#[test]
fn what_another_program_writes_is_no_damage_to_a_reader() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let [paint, glass] =
        ["mannequin-paint", "glass"].map(|name| builtin::get(name).unwrap().unwrap());
    Store::open(&path).unwrap().add([&paint]).unwrap();
    let mut reader = Store::open(&path).unwrap();
    for round in 0..20 {
        let mut writer = Store::open(&path).unwrap();
        if round % 2 == 0 {
            writer.add([&glass]).unwrap();
        } else {
            writer.remove([&glass.slug]).unwrap();
        }
        drop(writer);
        assert_eq!(
            reader.search("paint", &Filter::default(), 9).unwrap().len(),
            1,
            "round {round}"
        );
        assert_eq!(reader.damage().unwrap(), Vec::<String>::new(), "round {round}");
        assert_eq!(reader.find(&Filter::default()).unwrap().len(), 1 + (round + 1) % 2);
        reader.add([&paint]).unwrap();
    }
}

#[test]
fn programs_write_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("materials.sqlite");
    let start = |writer: usize| {
        child("store_concurrent::writing_program", &path)
            .env("MATDB_TEST_WRITER", writer.to_string())
            .spawn()
            .unwrap()
    };
    let programs: Vec<_> = (0..WRITERS).map(start).collect();
    for mut program in programs {
        assert!(program.wait().unwrap().success());
    }
    check(&path);
}

/// Not a test by itself: the program that `programs_write_at_once` starts.
#[test]
fn writing_program() {
    let Some(path) = given() else { return };
    write(&path, std::env::var("MATDB_TEST_WRITER").unwrap().parse().unwrap());
}

#[test]
fn the_same_material_added_twice_at_once_is_there_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("materials.sqlite");
    let add = || Store::open(&path).unwrap().add([&sample("paint")]).unwrap()[0];
    let [first, second] = std::thread::scope(|scope| {
        [scope.spawn(add), scope.spawn(add)].map(|thread| thread.join().unwrap())
    });
    let mut added = [first, second];
    added.sort_by_key(|added| *added != Addition::New);
    assert_eq!(added, [Addition::New, Addition::Unchanged(1)]);
}
