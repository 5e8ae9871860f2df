//! `matdb diagnose`.

mod args;
mod cloud;
mod curve;
mod refusal;

use super::console::Console;
use crate::error::Error;
use crate::setup::Database;

pub(super) use args::Args;

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    match (&args.curve, &args.cloud, &args.scene[..]) {
        (Some(curve), None, []) => curve::run(curve, args, console),
        (None, Some(cloud), [_, ..]) => cloud::run(cloud, args, db, console),
        _ => Err(Error::usage(
            "a diagnosis is of a cloud and its scene, or of a curve",
            "give CLOUD --scene SCENE, or --curve FILE alone",
        )),
    }
}
