//! Other people's clouds and curves, by the program: from a file with columns of its own to a fitted material.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use crate::support::matdb;
use matdb::formats::{PointFormat, PointTable};

/// A scene of a ball that another radar looks at, from its own place; speckle of four looks and an error of range.
const SCENE: &str = r#"
name = "Another radar"
seed = 5

[radar]
position_m = [0.4, 1.3, 3.0]
look_at_m = [0.0, 1.0, 0.0]
threshold_dbm = -68.0
spot_diameter_m = 0.008

[radar.beam]
focus_m = 3.06

[radar.scan]
pattern = "angular-raster"
lines = 90
chirps_per_line = 90
azimuth_deg = [-4.2, 4.2]
elevation_deg = [-4.2, 4.2]

[radar.speckle]
looks = 4
form = "independent"

[radar.noise]
level_dbm = -100
range_sd_m = 0.002

[[mesh]]
name = "ball"
file = "builtin:sphere"
size_m = [0.4, 0.4, 0.4]
translation_m = [0, 1, 0]

[[region]]
name = "paint"
material = "mannequin-paint"
"#;

/// Places and powers of what the radar detects.
fn detections(folder: &Path) -> Vec<[f64; 5]> {
    fs::write(folder.join("theirs.toml"), SCENE).unwrap();
    matdb(folder).args(["render", "theirs.toml", "-o", "out", "-q"]).assert().success();
    let bytes = fs::read(folder.join("out/cloud.ply")).unwrap();
    let table = PointTable::read(PointFormat::Ply, &bytes).unwrap();
    let column = |name| table.column(name).unwrap().unwrap();
    let columns = ["x", "y", "z", "power_dbm", "range_m"].map(column);
    (0..table.len()).map(|row| [0, 1, 2, 3, 4].map(|at| columns[at][row])).collect()
}

/// As `numpy.savetxt` writes it.
fn xyz(points: &[[f64; 5]]) -> String {
    let lines = points
        .iter()
        .map(|[x, y, z, level, _]| format!("{x:.18e} {y:.18e} {z:.18e} {level:.18e}\n"));
    "X Y Z Intensity\n".to_owned() + &lines.collect::<String>()
}

/// What the program prints, or its error.
fn said(folder: &Path, arguments: &str) -> String {
    let output = matdb(folder).args(arguments.split(' ')).output().unwrap();
    String::from_utf8([output.stdout, output.stderr].concat()).unwrap()
}

fn refused(folder: &Path, arguments: &str) -> String {
    let output = matdb(folder).args(arguments.split(' ')).output().unwrap();
    assert!(!output.status.success(), "{arguments}");
    String::from_utf8(output.stderr).unwrap()
}

/// An estimate of a fit, and its standard deviation.
fn estimate(fit: &serde_json::Value, name: &str) -> [f64; 2] {
    let estimates = fit["estimates"].as_array().unwrap();
    let found = estimates.iter().find(|estimate| estimate["name"] == name).unwrap();
    ["value", "sd"].map(|key| found[key].as_f64().unwrap())
}

#[test]
fn three_steps_lead_from_a_foreign_cloud_to_a_curve() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let points = detections(at);
    fs::write(at.join("scan.xyz"), xyz(&points)).unwrap();
    let own = said(at, "measure out/cloud.ply --scene theirs.toml --exact-mesh -o own");
    assert!(own.contains("curve:") && !own.contains("passed over"), "{own}");
    let mesh = "--mesh builtin:sphere";
    let columns = "--columns Intensity=power_dbm";
    let unknown = refused(at, &format!("new scene --cloud scan.xyz {columns} {mesh}"));
    assert!(
        unknown.contains("0 of the points have a range") && unknown.contains("--radar-at"),
        "{unknown}"
    );
    let new =
        format!("new scene --cloud scan.xyz {columns} {mesh} --radar-at 0.4,1.3,3 --look-at 0,1,0");
    let made = said(at, &new);
    assert!(made.contains("0.400, 1.300, 3.000 m (as given)"), "{made}");
    assert!(made.contains("beside the mesh"), "the ball of a metre stands at the origin: {made}");
    let again = refused(at, &new);
    assert!(again.contains("scene.toml exists already"), "{again}");
    // Chirps that only some points number keep their numbers, and the others get free ones.
    let mut some = "X,Y,Z,Intensity,chirp\n".to_owned();
    for (row, [x, y, z, level, _]) in points.iter().enumerate() {
        let chirp = if row % 3 == 0 { (row + 7).to_string() } else { String::new() };
        some += &format!("{x},{y},{z},{level},{chirp}\n");
    }
    fs::write(at.join("some.csv"), some).unwrap();
    let numbered = said(at, &(new.replace("scan.xyz", "some.csv") + " -o some.toml"));
    assert!(numbered.contains("wrote some.toml"), "{numbered}");
    let rays = fs::read_to_string(at.join("some-rays.csv")).unwrap();
    let numbers: Vec<u32> =
        rays.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
    let distinct: std::collections::HashSet<&u32> = numbers.iter().collect();
    assert_eq!((distinct.len(), numbers[3]), (points.len(), 10));
    // What a person changes: size and place of the ball, the beam, and that rays are single.
    let scene = fs::read_to_string(at.join("scene.toml")).unwrap();
    assert!(
        scene.contains("complete = false") && scene.contains("position_m = [0.4, 1.3, 3]"),
        "{scene}"
    );
    let changed = scene
        .replace("rays = 16 ", "rays = 1 ")
        .replace("# spot_diameter_m = 0.016", "spot_diameter_m = 0.008")
        .replace("file = \"builtin:sphere\"", "file = \"builtin:sphere\"\nsize_m = [0.4, 0.4, 0.4]")
        .replace("# translation_m = [0, 0, 0]", "translation_m = [0, 1, 0]");
    fs::write(at.join("scene.toml"), changed).unwrap();
    let measured = said(
        at,
        &format!("measure scan.xyz {columns} --scene scene.toml --exact-mesh -o measured"),
    );
    assert!(measured.contains("and 0 censored chirps"), "{measured}");
    // A radar that stood elsewhere: its rays meet hardly a point.
    let elsewhere = SCENE.replace("position_m = [0.4, 1.3, 3.0]", "position_m = [2.4, 1.3, 3.0]");
    fs::write(at.join("elsewhere.toml"), elsewhere).unwrap();
    let off = format!(
        "measure scan.xyz {columns} --scene elsewhere.toml --pose 0,0,0 --keep-pose -o off"
    );
    let off = refused(at, &off);
    assert!(off.contains("points lie on no ray of the scan: is the radar's place right"), "{off}");
    assert!(!at.join("off").exists());
    let curve = fs::read_to_string(at.join("measured/curve.csv")).unwrap();
    assert!(
        curve.starts_with("theta_deg,")
            && curve.lines().next().unwrap().contains("threshold_db,footprint")
    );
    let fit = said(at, "fit measured/curve.csv --noise-dbm -100 --json -q");
    let fit: serde_json::Value = serde_json::from_str(&fit).unwrap();
    for (name, truth) in [("diffuse.alpha", 3.0), ("looks", 4.0)] {
        let [value, sd] = estimate(&fit, name);
        assert!((value - truth).abs() < 4.0 * sd, "{name}: {value} ± {sd}");
    }
}

#[test]
fn every_format_and_a_known_range_give_the_same_place_and_cloud() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let points = detections(at);
    let mut csv = "chirp;X;Y;Z;Level;Range\n".to_owned();
    let mut pcd = format!(
        "VERSION 0.7\nFIELDS x y z intensity range_m\nSIZE 8 8 8 4 8\nTYPE F F F F F\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA ascii\n",
        points.len()
    );
    let mut builder = las::Builder::from((1, 4));
    builder.point_format =
        las::point::Format { is_compressed: true, ..las::point::Format::new(1).unwrap() };
    builder.transforms.x.scale = 1e-6;
    builder.transforms.y.scale = 1e-6;
    builder.transforms.z.scale = 1e-6;
    let mut writer =
        las::Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    for (chirp, [x, y, z, level, range]) in points.iter().enumerate() {
        let comma = |number: &f64| format!("{:.4}", 1e3 * number).replace('.', ",");
        csv += &format!(
            "{chirp};{};{};{};{};{}\n",
            comma(x),
            comma(y),
            comma(z),
            format!("{level:.5}").replace('.', ","),
            comma(range)
        );
        pcd += &format!("{x} {y} {z} {level} {range}\n");
        // Ten counts for each dB above −100 dBm would be a logarithm; a radar's counts are powers.
        let intensity = (10f64.powf(0.1 * (level + 68.0)) * 100.0).round().min(65535.0) as u16;
        let point = las::Point {
            x: *x,
            y: *y,
            z: *z,
            intensity,
            gps_time: Some(0.0),
            ..las::Point::default()
        };
        writer.write_point(point).unwrap();
    }
    fs::write(at.join("scan.csv"), csv).unwrap();
    fs::write(at.join("scan.pcd"), pcd).unwrap();
    fs::write(at.join("scan.laz"), writer.into_inner().unwrap().into_inner()).unwrap();
    let mesh = "--mesh builtin:sphere";
    let names = "--columns X=x_mm,Y=y_mm,Z=z_mm,Range=range_mm,Level=power_dbm";
    let csv = said(at, &format!("new scene --cloud scan.csv {names} {mesh} -o a.toml"));
    let pcd = said(
        at,
        &format!("new scene --cloud scan.pcd --columns intensity=power_dbm {mesh} -o b.toml"),
    );
    for (said, file) in [(csv, "a.toml"), (pcd, "b.toml")] {
        assert!(said.contains("0.400, 1.300, 3.000 m (found from the ranges"), "{file}: {said}");
    }
    let far = refused(
        at,
        &format!(
            "new scene --cloud scan.pcd --columns intensity=power_dbm {mesh} --radar-at 0,0,0 -o c.toml"
        ),
    );
    assert!(far.contains("its ranges differ from the distances to --radar-at by"), "{far}");
    // Counts have no level, so that the curve has none.
    let ball = SCENE.replace("name = \"Another radar\"", "name = \"counts\"");
    fs::write(at.join("counts.toml"), ball).unwrap();
    let measure = "measure scan.laz --columns intensity=power_counts,gps_time=- --scene counts.toml --exact-mesh -o counts";
    let measured = said(at, measure);
    assert!(!measured.contains("error"), "{measured}");
    let curve = fs::read_to_string(at.join("counts/curve.csv")).unwrap();
    assert!(curve.lines().next().unwrap().ends_with(",relative"), "{}", &curve[..200]);
    let fit = said(at, "fit counts/curve.csv --json -q");
    let fit: serde_json::Value = serde_json::from_str(&fit).unwrap();
    let [alpha, sd] = estimate(&fit, "diffuse.alpha");
    assert!((alpha - 3.0).abs() < 4.0 * sd, "{alpha} ± {sd}");
    assert!(fit["sentences"].to_string().contains("the levels are relative"), "{fit}");
    for command in [
        "compare scan.laz --columns intensity=power_counts --scene counts.toml --pose 0,0,0 -o no",
        "diagnose scan.laz --columns intensity=power_counts --scene counts.toml -o no",
        "near --curve counts/curve.csv",
    ] {
        let said = refused(at, command);
        assert!(said.contains("are relative"), "{command}: {said}");
    }
}

#[test]
fn clouds_that_say_too_little_or_too_much_are_refused_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("scene.toml"), SCENE).unwrap();
    for (name, text, flags, expected) in [
        (
            "a.csv",
            "X,Y,Z,I\n1,2,3,-60\n",
            "",
            "no column power_dbm (power_w for watts; power_db for decibels of an unknown level, power_counts for counts); it has: X, Y, Z, I; \
             say which they are, as by --columns THEIRS=power_dbm",
        ),
        (
            "b.csv",
            "x,y,z,power_dbm,power_w\n1,2,3,-60,1e-9\n",
            "",
            "both power_dbm and power_w; pass one over",
        ),
        (
            "c.csv",
            "x,y,z,power\n1,2,3,-60\n",
            " --columns pover=power_dbm",
            "no column `pover`; did you mean `power`?",
        ),
        (
            "d.csv",
            "x,y,z,power\n1,2,3,-60\n",
            " --columns power=power_dbm,power=chirp",
            "gets two names",
        ),
        ("e.csv", "x,x,z,power\n1,2,3,-60\n", "", "column `x` is there twice"),
        ("f.csv", "x,y,z,power\n1,2,3,\n", "", "line 2, column power: the cell is empty"),
        ("g.xyz", "1 2 3 4 5\n", "", "it has: 1, 2, 3, 4, 5"),
        ("h.las", "LASF", "", "the file: "),
        ("i.xyz", "1 2 3 0\n1 2 4 0\n", "", "all 2 powers are 0: the file has none"),
        ("i.pcd", "VERSION 0.7\n", "", "there is no line DATA"),
        ("j.xyz", "1 2 3 0\n", " --power counts", "point 0 has 0 counts"),
        ("k.abc", "", "", ".ply, .csv, .xyz"),
    ] {
        fs::write(at.join(name), text).unwrap();
        let error = refused(at, &format!("measure {name}{flags} --scene scene.toml -o out"));
        assert!(error.contains(expected), "{name}: {error}");
        assert!(!at.join("out").exists());
    }
    let error = refused(at, "measure a.csv --columns X --scene scene.toml -o out");
    assert!(error.contains("write THEIRS=OURS"), "{error}");
}

#[test]
fn a_foreign_curve_is_fitted_compared_and_stored() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut text = "grazing;NRCS;wind\n".to_owned();
    for k in 0..40 {
        let theta_rad = f64::from(k) * 0.03;
        let level = 0.02 * theta_rad.cos().powi(3);
        text += &format!("{};{level};7,5\n", 90.0 - theta_rad.to_degrees()).replace('.', ",");
    }
    fs::write(at.join("sea.csv"), text).unwrap();
    let columns = "--columns grazing=grazing_deg,NRCS=sigma0";
    let fit = said(at, &format!("fit sea.csv {columns} --model lambert --looks 100"));
    assert!(fit.contains("passed over: wind") && fit.contains("converged"), "{fit}");
    let near = said(at, &format!("near --curve sea.csv {columns} --measured-at 300"));
    assert!(near.contains("at 40 angles of the curve"), "{near}");
    let add = format!(
        "add --from sea.csv {columns} --name sea --class water --kind synthetic --source drawn --licence CC0-1.0 --frequency 300"
    );
    let added = said(at, &add);
    assert!(added.contains("added sea, revision 1"), "{added}");
    // A table in the plane of incidence.
    let mut plane = "theta_i_deg,theta_s_deg,brdf_per_sr\n".to_owned();
    for k in 0..20 {
        let level = 0.1 + 0.002 * f64::from(k % 3);
        plane += &format!("{0},{1},{level}\n{0},{0},0.1\n", 3 * k + 1, -(3 * k + 1));
    }
    fs::write(at.join("plane.csv"), plane).unwrap();
    let fit = said(at, "fit plane.csv --model lambert -o plane.svg");
    assert!(fit.contains("20 of them with source and receiver in two directions"), "{fit}");
    assert!(fit.contains("converged"), "{fit}");
    let drawn = fs::read_to_string(at.join("plane.svg")).unwrap();
    assert!(drawn.contains("incidence 1°") && drawn.contains("receiver"));
    let error = refused(at, "fit plane.csv --model lambert --method tls");
    assert!(error.contains("row 1 (from 0) source and receiver were in two"), "{error}");
    let near = said(at, "near --curve plane.csv --measured-at 300");
    assert!(near.contains("at 40 angles of the curve"), "{near}");
    let add = "add --from plane.csv --name plane --class paint --kind synthetic --source drawn --licence CC0-1.0 --frequency 300";
    assert!(said(at, add).contains("added plane"));
    let shown = said(at, "show plane --json");
    assert!(shown.contains("theta_r_rad"), "{shown}");
    // The same as rows of two directions is diagnosed alike; one out of the plane of incidence is not.
    let mut rows = "theta_deg,theta_r_deg,delta_phi_deg,sigma0_db\n".to_owned();
    for k in 0..40 {
        let level_db = 1.0 - 0.05 * f64::from(k) + 0.1 * f64::from(k % 3);
        rows += &format!("20,{},180,{level_db}\n", 2 * k);
    }
    fs::write(at.join("rows.csv"), &rows).unwrap();
    let found = said(at, "diagnose --curve rows.csv --noise-db 0.1 -o rows");
    assert!(found.contains("error on held-out angles"), "{found}");
    fs::write(at.join("aside.csv"), rows + "20,30,90,1\n").unwrap();
    let error = refused(at, "diagnose --curve aside.csv --noise-db 0.1 -o aside");
    assert!(error.contains("point 41 (from 1): it is out of the plane of incidence"), "{error}");
    // Levels of an unknown unit have a shape alone.
    let relative = "theta_deg,sigma0_db,relative\n0,20,1\n20,15,1\n40,5,1\n68,-20,1\n";
    fs::write(at.join("relative.csv"), relative).unwrap();
    let error = refused(at, "near --curve relative.csv --measured-at 300");
    assert!(error.contains("rank by shape (--shape)"), "{error}");
    let near = said(at, "near --curve relative.csv --shape --measured-at 300");
    assert!(near.contains("ranked by shape, its level left open"), "{near}");
    let add = "add --from relative.csv --name unknown-unit --class paint --kind synthetic --source drawn --licence CC0-1.0 --frequency 300";
    assert!(said(at, add).contains("added unknown-unit"));
    let near = said(at, &format!("near --curve sea.csv {columns} --measured-at 300 --limit 90"));
    let marked: Vec<&str> =
        near.lines().filter(|line| line.contains("its level is relative")).collect();
    assert!(marked.len() == 1 && marked[0].starts_with("unknown-unit"), "{near}");
    // What is stored is found again by its own fit.
    let saved = said(at, "fit plane --model lambert --save");
    assert!(saved.contains("stored as fit"), "{saved}");
    said(at, "check");
}

#[test]
fn a_table_without_backscatter_is_stored_with_the_model_that_is_rendered() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // A lobe over a floor at two incidences, in a table of an optical design program and in one of ours.
    let radials_deg: Vec<f64> = (0..13).map(|k| f64::from(5 * k)).collect();
    let axis: Vec<String> = radials_deg.iter().map(f64::to_string).collect();
    let axis = axis.join(" ");
    let mut bsdf = format!(
        "Source Measured\nScatterType BRDF\nSampleRotation 1\n0\nAngleOfIncidence 2\n20 40\n\
         ScatterAzimuth 2\n0 180\nScatterRadial 13\n{axis}\nMonochrome\nDataBegin\n"
    );
    let mut csv = "theta_i_deg,theta_s_deg,brdf_per_sr\n".to_owned();
    for incidence_deg in [20.0, 40.0] {
        bsdf += "TIS 0.2\n";
        for towards in [-1.0, 1.0] {
            let mut row = Vec::new();
            for (place, radial_deg) in radials_deg.iter().enumerate() {
                let theta_s_deg: f64 = incidence_deg + towards * radial_deg;
                let tilt = 0.5 * (incidence_deg - theta_s_deg).to_radians();
                let noise = 1.0 + 0.01 * f64::from((7 * place as u32) % 5) - 0.02;
                let f = (0.03 + 0.4 * (-(tilt / 0.2).powi(2)).exp()) * noise;
                row.push(format!("{f:.6}"));
                if theta_s_deg.abs() <= 80.0
                    && (towards < 0.0 || *radial_deg > 0.0)
                    && theta_s_deg > -19.0
                {
                    csv += &format!("{incidence_deg},{theta_s_deg},{f:.6}\n");
                }
            }
            bsdf += &format!("{}\n", row.join(" "));
        }
    }
    fs::write(at.join("coating.bsdf"), bsdf).unwrap();
    fs::write(at.join("coating.csv"), csv).unwrap();
    let fit = said(at, "fit coating.bsdf --model mixture");
    assert!(fit.contains("converged") && fit.contains("in two directions"), "{fit}");
    assert!(
        said(at, "near --curve coating.bsdf --measured-at 300").contains("angles of the curve")
    );
    let given = "--class paint --kind synthetic --source drawn --licence CC0-1.0 --frequency 300";
    let error = refused(at, &format!("add --from coating.csv --name coating {given}"));
    assert!(error.contains("no row is backscatter") && error.contains("--model"), "{error}");
    let added = said(at, &format!("add --from coating.csv --model mixture --name coating {given}"));
    assert!(added.contains("added coating, revision 1"), "{added}");
    said(at, "check");
    let near = said(at, "near --curve coating.csv --measured-at 300 --limit 1");
    assert!(near.contains("coating") && !near.contains("left out: 0"), "{near}");
    let predicted = said(at, "predict coating --angles 20:40:10");
    assert!(predicted.contains("30"), "{predicted}");
    assert!(
        said(at, &format!("add --from coating.bsdf --model mixture --name two {given}"))
            .contains("added two")
    );
    let error = refused(at, "fit absent.bsdf");
    assert!(error.contains("cannot read absent.bsdf"), "{error}");
}

#[test]
fn new_files_load_and_are_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = said(at, "new material my-wall");
    assert!(made.contains("matdb add --from my-wall"), "{made}");
    let added = matdb(at).args(["add", "--from", "my-wall"]).assert().success();
    let output = added.get_output();
    let [said, notes] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(said.contains("added my-wall, revision 1"), "{said}");
    assert!(notes.contains("`bench` has the DOI of the template"), "{notes}");
    assert!(refused(at, "new material my-wall").contains("exists already"));
    assert!(refused(at, "new material My.Wall").contains("My.Wall"));
}
