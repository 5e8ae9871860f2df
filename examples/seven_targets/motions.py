"""Rigid motions: a shift of one point and a turn, six numbers, and the spaces that some of them span."""

import re

import numpy as np


def turn(axis, degrees):
    """Rotation matrix about an axis."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def direction(rng):
    """A unit vector, each as likely as any other."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def complement(axes):
    """Orthonormal columns across the rows."""
    return np.linalg.svd(np.vstack([axes, np.zeros((1, 3))]))[2][len(axes):].T


def both(shifts, turns):
    """Columns of the motions along the first rows and about the second ones."""
    motions = np.zeros((6, len(shifts) + len(turns)))
    motions[:3, :len(shifts)], motions[3:, len(shifts):] = np.transpose(shifts), np.transpose(turns)
    return motions


def displacements(at, about):
    """What each motion moves the points by: points, axes, motions."""
    turns = np.cross(np.eye(3)[None], (at - about)[:, None])
    return np.concatenate([np.broadcast_to(np.eye(3), turns.shape), turns], 1).transpose(0, 2, 1)


def seen_from(point, other):
    """The matrix that takes a motion, as the shift of one point and a turn, to the shift of another point."""
    matrix = np.eye(6)
    matrix[:3, 3:] = np.cross(np.eye(3), point - other)
    return matrix


def apart(some, others):
    """Sine of the largest angle between two spaces of motions; 1 where they have not as many dimensions."""
    if some.shape != others.shape:
        return 1.0
    p, q = np.linalg.qr(some)[0], np.linalg.qr(others)[0]
    return np.linalg.norm(q - p @ (p.T @ q), 2) if some.size else 0.0


def misnamed(sentences, shifts, turns, about):
    """How far named motions are from shifts along axes and turns about axes through a point: the largest part of a unit shift, of
    an axis, or of the metres from axis to point that is not theirs. Infinite where there are not as many of each."""
    number = r"\(([-\d.]+), ([-\d.]+), ([-\d.]+)\)"
    forms = [rf"any turn about {number} m", rf"a turn about the axis along {number} through {number} m",
             rf"a shift along {number}"]
    named = []
    for sentence in sentences:
        every, one, shift = (re.fullmatch(form, sentence) for form in forms)
        if not (every or one or shift):
            return np.inf
        numbers = np.array((every or one or shift).groups(), float)
        if shift:
            named.append(np.concatenate([numbers, np.zeros(3)]))
        else:
            axes = np.eye(3) if every else numbers[None, :3]
            named += [np.concatenate([np.cross(axis, about - numbers[-3:]), axis]) for axis in axes]
    named = np.reshape(named, (-1, 6))
    turned = int(named[:, 3:].any(1).sum())
    independent = np.linalg.svd(named, compute_uv=False).min(initial=1) > 0.5
    if not independent or (len(named) - turned, turned) != (len(shifts), len(turns)):
        return np.inf
    strange = np.hstack([named[:, :3] @ complement(shifts), named[:, 3:] @ complement(turns)])
    return np.linalg.norm(strange, axis=1).max(initial=0)
