//! What stands in for a device in a program that was built without: there is none to be had.

use std::convert::Infallible;

use super::GpuError;
use super::packed::{Aim, Corners, Node};

pub(super) struct Device(Infallible);

pub(super) struct Tree(Infallible);

pub(super) struct Flight(Infallible);

impl Device {
    pub fn open(_: u64) -> Result<Device, GpuError> {
        Err(GpuError::NotBuilt)
    }

    pub fn adapter(&self) -> &str {
        match self.0 {}
    }

    pub fn rays_at_once(&self, _: u64) -> usize {
        match self.0 {}
    }

    pub fn hold(&self, _: &[Node], _: &[Corners]) -> Result<Tree, GpuError> {
        match self.0 {}
    }

    pub fn launch(&self, tree: &Tree, _: &[Aim]) -> Result<Flight, GpuError> {
        match tree.0 {}
    }

    pub fn land(&self, flight: Flight) -> Result<Vec<u32>, GpuError> {
        match flight.0 {}
    }
}
