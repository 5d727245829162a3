"""Pictures of whole results: every row's matrices, with what another assumption makes of them."""
