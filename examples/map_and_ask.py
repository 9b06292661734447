"""Map a simulated home with one turn of the robot, and ask where the plant most probably is."""

import math

from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.ooi_voxels import OoiVoxels
from ippon.mapping.voxel_map import VoxelMap
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

home = generate_home(7)
camera = PinholeCamera.from_horizontal_fov(320, 200, ZED.horizontal_fov_rad)
world = SimulatedWorld(home, ZED, camera, home.start_poses[0])
world.set_labels(MATTERPORT_40, "plant")  # What the simulated segmentation tells apart.
voxel_map = VoxelMap(MapConfig(), MATTERPORT_40)
voxel_map.set_ooi("plant")  # The object of interest.
for _ in range(24):
    voxel_map.integrate(world.observe())  # Depth, colour and label probabilities of one image.
    world.step(Command(yaw_rate_rad_s=math.radians(30.0), tilt_rad=-0.3), dt_s=0.5)
points, probabilities = OoiVoxels(threshold=0.1).update(voxel_map.arrays())
best = probabilities.argmax()
print(f"p = {probabilities[best]:.2f} at {points[best].round(2)} m, {len(points)} voxels above 0.1")
