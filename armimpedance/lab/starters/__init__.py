"""Example folders for laboratories, one file each; `armimpedance new --for NAME` writes them."""
