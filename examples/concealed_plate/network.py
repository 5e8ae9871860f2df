"""A small U-Net that marks the pixels of a plate and says whether a scan has one."""

import numpy as np
import torch
from torch import nn
from torch.nn import functional

WIDTHS, BATCH, RATE = (12, 24, 48), 32, 2e-3


def convolution(inputs, outputs):
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, padding=1), nn.BatchNorm2d(outputs), nn.ReLU())


class Network(nn.Module):
    """Two halvings and back for the mask; the coarsest features and the mask's maximum decide on the scan."""

    def __init__(self):
        super().__init__()
        a, b, c = WIDTHS
        self.fine, self.down = convolution(2, a), nn.Sequential(convolution(a, b), convolution(b, b))
        self.deep = nn.Sequential(convolution(b, c), convolution(c, c))
        self.up, self.out = convolution(b + c, b), convolution(a + b, a)
        self.mask, self.scan = nn.Conv2d(a, 1, 1), nn.Linear(c + 1, 1)

    def forward(self, x):
        fine = self.fine(x)
        down = self.down(functional.max_pool2d(fine, 2))
        deep = self.deep(functional.max_pool2d(down, 2))
        up = self.up(torch.cat([down, functional.interpolate(deep, scale_factor=2.0)], 1))
        mask = self.mask(self.out(torch.cat([fine, functional.interpolate(up, scale_factor=2.0)], 1)))[:, 0]
        seen = torch.cat([deep.amax((2, 3)), functional.avg_pool2d(mask[:, None], 3, 1).amax((2, 3))], 1)
        return mask, self.scan(seen)[:, 0]


def train(pictures, masks, seed, epochs):
    """A network trained with both losses; the rate falls to 0 as half a cosine."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    network = Network().train()
    x, y = torch.from_numpy(pictures), torch.from_numpy(masks).float()
    has = y.amax((1, 2))
    descent = torch.optim.Adam(network.parameters(), RATE)
    steps = epochs * (len(x) // BATCH)
    rate = torch.optim.lr_scheduler.CosineAnnealingLR(descent, steps)
    for _ in range(epochs):
        order = torch.randperm(len(x))
        for part in order[:len(x) // BATCH * BATCH].reshape(-1, BATCH):
            mirrored = torch.rand(()) < 0.5
            picture, truth = (t[part].flip(-1) if mirrored else t[part] for t in (x, y))
            mask, scan = network(picture)
            loss = 5 * functional.binary_cross_entropy_with_logits(mask, truth)
            loss = loss + functional.binary_cross_entropy_with_logits(scan, has[part])
            descent.zero_grad()
            loss.backward()
            descent.step()
            rate.step()
    return network.eval()


def predict(network, pictures):
    """Probability of a plate in each pixel, and the score of each scan."""
    with torch.no_grad():
        parts = [network(x) for x in torch.from_numpy(pictures).split(100)]
    return (torch.cat([mask for mask, _ in parts]).sigmoid().numpy(),
            torch.cat([scan for _, scan in parts]).numpy().astype(np.float64))
