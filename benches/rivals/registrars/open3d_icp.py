"""Open3D's ICP: open3d_icp.py Point|Plane FOLDER."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import open3d as o3d

from registrars import clouds
from serve import serve, timed

icp = o3d.pipelines.registration
method = {
    "Point": icp.TransformationEstimationPointToPoint(),
    "Plane": icp.TransformationEstimationPointToPlane(),
}[sys.argv[1]]
measured, virtual = clouds.read(sys.argv[2])


def cloud(points, normals=None):
    made = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    if normals is not None:
        made.normals = o3d.utility.Vector3dVector(normals)
    return made


def register():
    """What a user repeats for each pose."""
    source, target = cloud(measured), cloud(virtual[:, :3], virtual[:, 3:])
    criteria = icp.ICPConvergenceCriteria(1e-9, 1e-9, clouds.STEPS)
    return icp.registration_icp(source, target, clouds.REACH_M, np.eye(4), method, criteria)


def turn():
    ms, found = timed(register)
    return {"ms": ms, "pose": found.transformation.tolist()}


serve({"version": o3d.__version__}, turn)
