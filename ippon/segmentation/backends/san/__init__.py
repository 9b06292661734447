"""SAN, the side adapter network (Xu et al., CVPR 2023), for open-vocabulary segmentation."""
