//! The page of a data set: what it holds, how it was made, and what it is not.

use super::plan::{Dataset, Plan, PlannedSplit};
use super::points;
use super::spec::{Choice, EffectDraw, Numbers, Posterior, Variation};
use super::table::Column;
use crate::formats::words::{counted, listed};

/// The page as Markdown, with the columns of the table of scans.
pub(super) fn card(dataset: &Dataset, columns: &[Column]) -> String {
    let (spec, plan) = (&dataset.recipe.spec, &dataset.plan);
    let Plan { scans, shards, program, id, split, classes, .. } = plan;
    let title = if spec.title.is_empty() { &spec.name } else { &spec.title };
    let licence = if spec.licence.is_empty() { "not stated" } else { &spec.licence };
    let mut text = format!("# {title}\n\n");
    if !spec.description.is_empty() {
        text += &format!("{}\n\n", spec.description);
    }
    text += &format!(
        "All of it is synthetic: {} of a modelled scene, rendered by {program}. Nothing here was measured, though laws of materials may \
         be fitted to measurements. Licence: {licence}. Made by: {}. Plan `{id}`, seed {}.\n\n",
        counted(*scans as usize, "scan"),
        if spec.creators.is_empty() { "not stated".to_owned() } else { listed(&spec.creators) },
        spec.seed
    );
    text += &format!(
        "## Splits\n\n{} in {}.\n\n",
        counted(*scans as usize, "scan"),
        counted(*shards as usize, "shard")
    );
    text += "| split | scans | what no other split has |\n|---|---|---|\n";
    for PlannedSplit { name, scans, apart, .. } in split {
        let apart =
            apart.iter().map(|(choice, options)| format!("{choice}: {}", options.join(", ")));
        text += &format!("| {name} | {scans} | {} |\n", apart.collect::<Vec<_>>().join("; "));
    }
    text += "\n## Files\n\n| file | holds |\n|---|---|\n\
             | `scans.parquet` | a row for each scan: what was drawn for it, and counts |\n\
             | `points/SHARD.parquet` | a row for each return of each chirp, and for each chirp without one; a row group for each scan |\n";
    if spec.images {
        text += "| `images/SHARD.tar` | images of each scan as WebDataset: `KEY.power.exr` (dBm) and `KEY.range.exr` (m) as measured, \
                 `KEY.truth.exr` (depth in m and incidence in degrees), `KEY.instance.png` and `KEY.material.png` (16 bit; 0 for \
                 nothing, material numbers plus 1), `KEY.json` (grid and boxes) |\n\
                 | `coco/SHARD.json`, `voc/SHARD.tar` | the boxes in the forms of COCO and of Pascal VOC |\n";
    }
    text += "| `manifests/SHARD.json` | hashes (BLAKE3) of a shard's files, and what was drawn |\n\
             | `plan.toml`, `spec.toml`, `inputs/` | everything that it is made of |\n\n";
    text += "## Labels\n\n`instance` counts the meshes from 1, `region` and `material` count from 0; −1 and NaN are nothing. What \
             *caused* a return is labelled by `instance`, `region`, `material` and `facet`. What *lies along the axis* behind \
             everything that lets the wave through is labelled by the columns `sight_…`, `threat` and `threat_share`, and so are the \
             images.\n\n| number | instance | looked for | region | material |\n|---|---|---|---|---|\n";
    let most = classes.instances.len().max(classes.regions.len()).max(classes.materials.len());
    for place in 0..=most {
        let instance = place.checked_sub(1).and_then(|place| classes.instances.get(place));
        let wanted = instance.is_some_and(|name| classes.objects.contains(name));
        let [region, material] = [&classes.regions, &classes.materials]
            .map(|names| names.get(place).map_or("", String::as_str));
        text += &format!(
            "| {place} | {} | {} | {region} | {material} |\n",
            instance.map_or("", String::as_str),
            if wanted { "yes" } else { "" }
        );
    }
    text += "\n## What varies\n\n";
    for Choice { name, option, apart } in &spec.choose {
        let names: Vec<&str> = option.iter().map(|option| option.name.as_str()).collect();
        let apart = if *apart { ", none in two splits" } else { "" };
        text += &format!("- {name}: one of {}{apart}\n", names.join(", "));
    }
    for Variation { keys, from, to, mean, sd, values } in &spec.vary {
        let how = match (from, to, mean, sd) {
            (from, to, Some(mean), Some(sd)) => {
                let ends = [("from", from), ("to", to)];
                let ends = ends.into_iter().filter_map(|(word, ends)| {
                    Some(format!(", {word} {:?}", ends.as_ref()?.list()))
                });
                let [mean, sd] = [mean, sd].map(Numbers::list);
                let ends = ends.collect::<String>();
                format!("normal, mean {mean:?} and standard deviation {sd:?}{ends}")
            }
            (Some(from), Some(to), ..) => {
                format!("from {:?} to {:?}, evenly", from.list(), to.list())
            }
            _ => format!(
                "one of {}",
                values.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
            ),
        };
        text += &format!("- `{}`: {how}\n", keys.join("`, `"));
    }
    for placing in &spec.place {
        text += &format!(
            "- `{}` lies on `{}`, {} m off it, without cutting it\n",
            placing.mesh, placing.on, placing.gap_m
        );
    }
    for Posterior { material, inflate, .. } in &spec.posterior {
        text += &format!(
            "- the law of `{material}`: drawn from the covariance of its fit, standard deviations times {inflate}\n"
        );
    }
    for EffectDraw { name, share, .. } in &spec.effect {
        text += &format!("- effect `{name}` in {:.0} % of the scans\n", 100.0 * share);
    }
    text += "- speckle and noise, by a seed of each scan\n\n";
    text += &format!(
        "## Columns of `points`\n\n{}\n## Columns of `scans.parquet`\n\n{}\n",
        table(&points::columns()),
        table(columns)
    );
    text += "## Load it\n\n```python\nimport pandas as pd\n\nscans = pd.read_parquet(\"scans.parquet\")\n\
             points = pd.read_parquet(f\"points/{scans.shard[0]}.parquet\")\n```\n";
    text
}

fn table(columns: &[Column]) -> String {
    let mut text = "| column | unit (UCUM) | meaning |\n|---|---|---|\n".to_owned();
    for Column { name, unit, about, .. } in columns {
        text += &format!("| `{name}` | {unit} | {about} |\n");
    }
    text
}
