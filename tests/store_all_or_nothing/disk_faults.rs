//! Calls of the file system that fail, disks that fill up, and power that is cut.

use std::fs;
use std::path::Path;

use matdb::adopt::{CatalogueImport, DatabaseCheck, publish, verify};
use matdb::brdf::{Brdf, Lambert, Sum};
use matdb::catalogue::{About, Probe, Rank};
use matdb::material::Material;
use matdb::setup::Database;
use matdb::store::{Filter, Store};

use crate::disk::{Fault, watch};
use crate::support::database::{change, contents, is_sound, lit, sound};
use crate::writes::{Failure, WRITES, Write, by_campaign};

/// Removes a database with what SQLite keeps beside it.
fn remove(path: &Path) {
    for ending in ["", "-wal", "-shm", "-journal"] {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        let _ = fs::remove_file(name);
    }
}

/// Which calls of a write are tried: every one, or a sample. Migrating and making take many more calls than the others.
fn every(write: Write, campaign: usize, sample: usize) -> usize {
    let factor = match write {
        Write::Make | Write::Migrate => 4,
        _ => 1,
    };
    by_campaign(campaign, sample * factor)
}

#[test]
fn any_call_of_the_file_system_may_fail() {
    for write in WRITES {
        let folder = tempfile::tempdir().unwrap();
        let (before, path) =
            (folder.path().join("before.sqlite"), folder.path().join("now.sqlite"));
        write.prepare(&before);
        for fault in [Fault::Once, Fault::Half, Fault::Full] {
            let mut hit = 0;
            for call in (1..).step_by(every(write, 1, 23)) {
                remove(&path);
                let _ = fs::copy(&before, &path);
                let (result, disk) = watch(fault, call, || write.run(&path, || {}));
                let when = format!("{fault:?} at call {call}");
                let done = write.is_done(&path, &when);
                assert!(done || result.is_err(), "{write:?}, {when}: claims to be done");
                if !disk.has_failed() {
                    result.unwrap();
                    break;
                }
                hit += 1;
            }
            assert!(hit >= by_campaign(8, 2), "{write:?}, {fault:?}: only {hit} calls");
        }
    }
}

#[test]
fn the_power_may_be_cut_at_any_change_of_the_disk() {
    for write in WRITES {
        let folder = tempfile::tempdir().unwrap();
        let (before, path) =
            (folder.path().join("before.sqlite"), folder.path().join("now.sqlite"));
        write.prepare(&before);
        let mut cuts = 0;
        for change in (1..).step_by(every(write, 1, 5)) {
            remove(&path);
            let _ = fs::copy(&before, &path);
            let (result, disk) = watch(Fault::PowerCut, change, || write.run(&path, || {}));
            for seed in 0..by_campaign(4, 2) as u64 {
                remove(&path);
                disk.leave_after_cut(seed << 32 | change);
                let done =
                    write.is_done(&path, &format!("power cut at change {change}, seed {seed}"));
                assert!(done || result.is_err(), "{write:?}: lost at change {change}, seed {seed}");
            }
            if !disk.has_failed() {
                result.unwrap();
                break;
            }
            cuts += 1;
        }
        assert!(cuts >= by_campaign(8, 2), "{write:?}: only {cuts} cuts");
    }
}

/// What a database holds, as its reader says.
fn answer(path: &Path) -> Result<Vec<Material>, Failure> {
    let Some(store) = Store::open_existing(path)? else { return Ok(Vec::new()) };
    let mut held = Vec::new();
    for summary in store.list()? {
        for number in 1..=summary.revision {
            held.extend(store.get(&summary.slug, Some(number))?.map(|stored| stored.material));
        }
    }
    Ok(held)
}

/// Whether `matdb check` finds a database to be whole.
fn is_whole(path: &Path) -> bool {
    let report = DatabaseCheck::default().run(&Database::new(Some(path)), &mut |_| ());
    report.is_ok_and(|report| report.findings.is_empty())
}

#[test]
fn a_disk_that_lies_about_what_it_has_stored_leaves_no_damage_unseen() {
    let mut damaged = 0;
    for write in WRITES {
        let folder = tempfile::tempdir().unwrap();
        let (before, path) =
            (folder.path().join("before.sqlite"), folder.path().join("now.sqlite"));
        write.prepare(&before);
        let states = write.before_and_after();
        for change in (1..).step_by(every(write, 1, 5)) {
            remove(&path);
            let _ = fs::copy(&before, &path);
            let (_, disk) = watch(Fault::LyingDisk, change, || write.run(&path, || {}));
            for seed in 0..by_campaign(4, 2) as u64 {
                remove(&path);
                disk.leave_after_cut(seed << 32 | change);
                let is_right = answer(&path).is_ok_and(|held| states.contains(&held));
                let is_whole = is_whole(&path);
                damaged += usize::from(!is_right);
                assert!(is_right || !is_whole, "{write:?}: change {change}, seed {seed}: unseen");
            }
            if !disk.has_failed() {
                break;
            }
        }
    }
    // Else the disk did not lie.
    assert!(damaged > by_campaign(20, 0), "only {damaged} damaged databases");
}

/// A command that reads: all that it answers.
type Read = fn(&Path) -> Result<String, Failure>;

const READS: [(&str, Read); 9] = [
    ("show", |path| Ok(format!("{:?}", answer(path)?))),
    ("list", |path| Ok(format!("{:?}", opened(path)?.list()?))),
    ("find", |path| Ok(format!("{:?}", opened(path)?.find(&Filter::default())?))),
    ("search", |path| Ok(format!("{:?}", opened(path)?.search("paint", &Filter::default(), 10)?))),
    ("history", |path| Ok(format!("{:?}", opened(path)?.history(&"subject".parse().unwrap())?))),
    ("near", |path| {
        let observations = &lit("probe").curves[0].observations;
        let probe = Probe::new(observations).unwrap();
        let nearest = probe.nearest(&opened(path)?, &Filter::default(), Rank::Shape, 3)?;
        Ok(format!("{nearest:?}"))
    }),
    ("check", |path| {
        let report = DatabaseCheck::default().run(&Database::new(Some(path)), &mut |_| ())?;
        // Findings end the command with status 1.
        match report.findings.first() {
            None => Ok(format!("{report:?}")),
            Some(found) => Err(found.to_string().into()),
        }
    }),
    ("publish", |path| {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("site");
        publish(&opened(path)?, &About::default(), &site, |_| ())?;
        match verify(&site)?.problems.first() {
            None => Ok(fs::read_to_string(site.join("SHA256SUMS")).unwrap()),
            Some(found) => Err(found.to_string().into()),
        }
    }),
    ("import", |path| {
        let folder = tempfile::tempdir().unwrap();
        let ours = folder.path().join("ours.sqlite");
        let import = CatalogueImport { bundle: path, prefix: None, dry_run: false };
        import.run(&Database::new(Some(&ours)))?;
        Ok(format!("{:?}", answer(&ours)?))
    }),
];

fn opened(path: &Path) -> Result<Store, Failure> {
    Store::open_existing(path)?.ok_or_else(|| "there is no database".into())
}

#[test]
fn a_command_that_reads_gives_the_right_answer_or_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("now.sqlite");
    let mut store = Store::open(&path).unwrap();
    // A law that reflects more than it receives: `check` has a notice of it.
    let mut bright = sound("bright");
    let half = Brdf::Lambert(Lambert { albedo: 0.8 });
    bright.fits[0].model = Brdf::Sum(Sum { parts: vec![half.clone(), half] });
    bright.fits[0].parameter_sources.clear();
    bright.fits[0].covariance = None;
    store.add([&sound("bystander"), &bright, &sound("subject")]).unwrap();
    store.add([&change(sound("subject"))]).unwrap();
    drop(store);
    for (name, read) in READS {
        let right = read(&path).unwrap();
        let mut hit = 0;
        for call in (1..).step_by(by_campaign(10, 90)) {
            let (result, disk) = watch(Fault::Once, call, || read(&path));
            if let Ok(answer) = &result {
                assert_eq!(*answer, right, "{name}: another answer when call {call} fails");
            }
            if !disk.has_failed() {
                result.unwrap();
                break;
            }
            hit += 1;
        }
        assert!(hit > 0, "{name}");
        assert!(is_sound(&path) && is_whole(&path), "{name}");
    }
}

#[test]
fn a_repair_is_done_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let (before, path) = (folder.path().join("before.sqlite"), folder.path().join("now.sqlite"));
    Store::open(&before).unwrap().add([&sound("subject"), &sound("other")]).unwrap();
    let right = contents(&before);
    let conn = rusqlite::Connection::open(&before).unwrap();
    conn.execute_batch("DELETE FROM unit WHERE column_name < 'p'; DROP VIEW v_curves").unwrap();
    drop(conn);
    let repair = |path: &Path| -> Result<bool, Failure> {
        let check = DatabaseCheck { repair: true };
        let report = check.run(&Database::new(Some(path)), &mut |_| ())?;
        Ok(report.findings.is_empty())
    };
    for fault in [Fault::Once, Fault::Half, Fault::Full, Fault::PowerCut] {
        for call in (1..).step_by(by_campaign(1, 31)) {
            remove(&path);
            // Repairs leave at most 99 copies.
            let _ = fs::remove_file(folder.path().join("now.sqlite.before-repair"));
            fs::copy(&before, &path).unwrap();
            let (result, disk) = watch(fault, call, || repair(&path));
            if fault == Fault::PowerCut {
                remove(&path);
                disk.leave_after_cut(call);
            }
            assert_eq!(contents(&path), right, "{fault:?} at call {call}");
            if result.is_ok_and(|is_mended| is_mended) {
                assert!(is_whole(&path), "{fault:?} at call {call}: claims to have mended it");
            }
            if !disk.has_failed() {
                assert!(is_whole(&path));
                break;
            }
        }
    }
}
