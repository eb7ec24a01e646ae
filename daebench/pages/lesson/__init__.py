"""Parts of a lesson's page: kernels that compute in it, pictures that were drawn beforehand, and the notebook beside it."""
